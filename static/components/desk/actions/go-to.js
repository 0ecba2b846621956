/** The dialog in which a person types where to go: a distance, a time, a frame or a joint. */

import { html } from '../../../core/page/html.js';
import { parsePlace } from '../../../core/wall/places.js';
import { chainage, timecode } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';

/** @param {Desk} desk */
export function openGoTo(desk) {
  const { dialog, parts } = openDialog({
    title: t('goto.title'),
    content: html`<form class="stack gap-3" data-part="form" novalidate>
      <label for="go-to-place">${t('goto.label')}</label>
      <div class="row">
        <input class="input" id="go-to-place" data-part="place" autocomplete="off" autocapitalize="off"
          spellcheck="false" enterkeyhint="go" aria-describedby="go-to-help go-to-fault" />
        <button class="button button--primary">${t('goto.go')}</button>
      </div>
      <p class="fault" id="go-to-fault" role="alert" data-part="fault"></p>
      <p class="help" id="go-to-help">${t('goto.help')}</p>
    </form>`,
  });
  parts.place.focus();
  parts.place.addEventListener('input', () => showFault(''));
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    const { frame, fault } = frameOf(desk, parts.place.value);
    showFault(fault ?? '');
    if (fault) return;
    dialog.close();
    desk.seek(frame);
    desk.axis.reveal(desk.track.row(frame).distance_mm);
  });

  function showFault(fault) {
    parts.fault.textContent = fault;
    parts.place.setAttribute('aria-invalid', String(fault !== ''));
  }
}

/** Returns the frame at a typed place, or why there is none. */
function frameOf(desk, typed) {
  const { track, playhead } = desk;
  const last = track.length - 1;
  if (last < 0) return { fault: t('goto.no_track') };
  const place = parsePlace(typed);
  if (!place) return { fault: t('goto.not_understood') };
  const { kind, value } = place;
  if (kind === 'frame') {
    return value <= last ? { frame: value } : { fault: t('goto.no_frame', { last }) };
  }
  if (kind === 'time') {
    const end = track.row(last).time_s;
    return value <= end ? { frame: track.frameAt(value) } : { fault: t('goto.no_time', { end: timecode(end) }) };
  }
  const { low, high } = track.range;
  const atDistance = (m) => ({ frame: track.frameAtDistance(m * 1000, playhead.value.frame) });
  if (kind === 'joint') {
    const joint = desk.joints.find(({ number }) => number === value);
    return joint ? atDistance(joint.distance_m) : { fault: t('goto.no_joint', { number: value }) };
  }
  // A tag ahead of the camera may lie slightly beyond the robot's range.
  if (value * 1000 < low - BEYOND_MM || value * 1000 > high + BEYOND_MM) {
    return { fault: t('goto.no_distance', { from: chainage(low / 1000), to: chainage(high / 1000) }) };
  }
  return atDistance(value);
}

const BEYOND_MM = 500;
