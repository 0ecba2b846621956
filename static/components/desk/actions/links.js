/**
 * Addresses of places in an inspection: ?defect=ID, ?finding=ID, ?t=12.3 (s), ?frame=123, ?d=12.40 (m). The address of
 * the page follows the selection, so that it can be shared at any time.
 */

import { html } from '../../../core/page/html.js';
import { ROUNDING_MM } from '../../../core/wall/spans.js';
import { t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { toast } from '../../shared/toast-stack/toast-stack.js';

/** Returns the address of an observation, or of a frame. @param {{defect: string}|{frame: string}} place */
export const linkTo = (place) => `${location.pathname}?${new URLSearchParams(place)}`;

/**
 * Shows what the address names, as soon as it is tracked, and updates the address with the selection from
 * then on.
 * @param {Desk} desk
 * @param {AbortSignal} signal
 */
export function followLinks(desk, signal) {
  desk.selection.addEventListener('change', () => writeAddress(desk), { signal });
  const frameOf = placeIn(new URLSearchParams(location.search), desk);
  if (!frameOf) return;
  const found = new AbortController();
  const until = { signal: AbortSignal.any([signal, found.signal]) };
  const look = () => {
    const frame = frameOf();
    if (frame === null) return;
    found.abort();
    desk.seek(frame);
  };
  // A person who goes elsewhere meanwhile does not want to be brought back.
  for (const type of ['keydown', 'pointerdown']) addEventListener(type, () => found.abort(), until);
  for (const source of [desk.track, desk.observations, desk.findings, desk.inspection]) {
    source.addEventListener('change', look, until);
  }
  look();
}

/** Copies the address of the selected defect, or of the shown frame, to the clipboard. */
export async function copyLink(desk) {
  const { frame } = desk.playhead.value;
  const place = desk.selection.value ? { defect: desk.selection.value } : { frame: String(Math.max(frame, 0)) };
  const link = location.origin + linkTo(place);
  try {
    await navigator.clipboard.writeText(link);
    toast(t('link.copied'));
  } catch (error) {
    // Over plain http there is no clipboard, and access may be refused.
    if (!(error instanceof TypeError || error instanceof DOMException)) throw error;
    const { parts } = openDialog({
      title: t('link.copy'),
      content: html`<div class="field"><label for="link">${t('link.here')}</label>
        <input class="input" id="link" readonly value="${link}" data-part="link" /></div>`,
    });
    parts.link.focus();
    parts.link.select();
  }
}

function writeAddress({ selection, observations }) {
  const isThere = selection.value && observations.find(selection.value);
  history.replaceState(null, '', isThere ? linkTo({ defect: selection.value }) : location.pathname);
}

/** Returns a function that finds the frame of an address, null while it is not tracked; null without a place. */
function placeIn(address, desk) {
  const number = (name) => {
    const value = Number(address.get(name) ?? NaN);
    return Number.isFinite(value) && address.get(name) !== '' ? value : null;
  };
  const { track, observations, inspection, selection } = desk;
  const last = () => track.length - 1;
  const isWhole = () => track.length > 0 && !inspection.isUnfinished;
  const [defect, finding] = [address.get('defect'), address.get('finding')];
  const [seconds, frame, metres] = [number('t'), number('frame'), number('d')];
  if (defect) {
    return () => {
      const item = observations.find(defect);
      if (item) selection.set(defect);
      return item && item.frame <= last() ? item.frame : null;
    };
  }
  if (finding) {
    return () => {
      const item = desk.findings.find(finding);
      if (!item || (item.frame ?? 0) > last()) return null;
      desk.lookAt(item);
      return item.frame;
    };
  }
  if (frame !== null) return () => (frame <= last() || isWhole() ? Math.max(0, Math.round(frame)) : null);
  if (seconds !== null) {
    const isReached = () => track.length > 0 && track.row(last()).time_s >= seconds;
    return () => (isReached() || isWhole() ? track.frameAt(seconds) : null);
  }
  if (metres === null) return null;
  const isReached = () => track.length > 0 && track.range.high >= 1000 * metres - ROUNDING_MM;
  return () => (isReached() || isWhole() ? track.frameAtDistance(1000 * metres, 0) : null);
}
