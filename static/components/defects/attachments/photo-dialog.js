/** The photos of a defect, enlarged one at a time: to be drawn on, ordered, saved and deleted. */

import { html, render } from '../../../core/page/html.js';
import { squareOf, toSquare } from '../../../core/wall/pixels.js';
import { mayEdit } from '../../../core/page/rights.js';
import { chainage, lengthUnit, timecode } from '../../../core/wall/units.js';
import { language, t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { measuresOnPhoto } from '../../film/measure/on-photo.js';
import { detach } from './actions.js';
import { openDrawing } from './drawing-dialog.js';
import { photosOf } from './photos.js';
import { paintStrokes } from './strokes.js';

/**
 * @param {import('../../desk/page/desk.js').Desk} desk
 * @param {string} observation
 * @param {string} shown id of the photo: that of the observation, or of an attachment
 * @param {string} title
 */
export function openPhotos(desk, observation, shown, title) {
  const { dialog, parts } = openDialog({
    title,
    size: 'wide',
    content: html`<div class="photos stack gap-3" data-part="photos"></div>`,
  });
  const end = new AbortController();
  dialog.addEventListener('close', () => end.abort());
  new PhotoDialog(desk, observation, shown, { title, dialog, place: parts.photos, signal: end.signal });
}

class PhotoDialog {
  #desk;
  #observation;
  #shown;
  #title;
  #dialog;
  #place;
  /** Whether what is saved has distance and code below the picture. */
  #isBurntIn = true;

  constructor(desk, observation, shown, { title, dialog, place, signal }) {
    this.#desk = desk;
    this.#observation = observation;
    this.#shown = shown;
    this.#title = title;
    this.#dialog = dialog;
    this.#place = place;
    for (const store of [desk.attachments, desk.observations])
      store.addEventListener('change', () => this.#show(), { signal });
    place.addEventListener('click', ({ target }) => {
      const button = target.closest('[data-do]');
      if (button) this.#do(button.dataset.do);
    });
    place.addEventListener('change', ({ target }) => {
      this.#isBurntIn = target.checked;
      this.#show();
    });
    this.#show();
  }

  get #item() {
    return this.#desk.observations.find(this.#observation);
  }

  #show() {
    const item = this.#item;
    const photos = item ? photosOf(this.#desk, item) : [];
    if (photos.length === 0) {
      this.#dialog.close();
      return;
    }
    const at = Math.max(
      0,
      photos.findIndex(({ id }) => id === this.#shown),
    );
    const photo = photos[at];
    this.#shown = photo.id;
    const focused = this.#place.contains(document.activeElement) ? document.activeElement.dataset.do : null;
    const square = squareOf(this.#desk.inspection.value.video);
    const parts = render(this.#place, markup(this.#desk, item, photos, at, this.#title, this.#isBurntIn));
    parts.picture.style.setProperty('--aspect', square.width / square.height);
    if (photo.strokes.length) paintStrokes(parts.strokes, photo.strokes, square);
    if (focused) this.#place.querySelector(`[data-do="${focused}"]:enabled`)?.focus();
  }

  #do(what) {
    const { attachments } = this.#desk;
    const item = this.#item;
    const photos = photosOf(this.#desk, item);
    const at = photos.findIndex(({ id }) => id === this.#shown);
    const go = (to) => {
      this.#shown = photos[to].id;
      this.#show();
    };
    const move = (to) => {
      const ordered = photos.map(({ attachment }) => attachment);
      ordered.splice(to, 0, ...ordered.splice(at, 1));
      attachments.order(item, ordered);
    };
    if (what === 'before') go(at - 1);
    if (what === 'after') go(at + 1);
    if (what === 'earlier') move(at - 1);
    if (what === 'later') move(at + 1);
    if (what === 'main') move(0);
    if (what === 'draw') this.#draw(item, photos[at]);
    if (what === 'delete') {
      this.#dialog.close(); // the message that offers the undo is beneath it
      detach(this.#desk, item, photos[at].attachment);
    }
  }

  async #draw(item, photo) {
    const { attachments } = this.#desk;
    const strokes = await openDrawing(photo, this.#desk.inspection.value.video, this.#title);
    if (!strokes) return;
    if (photo.attachment?.kind === 'drawing') attachments.redraw(item, photo.attachment, strokes);
    else this.#shown = attachments.add(item, { kind: 'drawing', frame: photo.frame, strokes });
    this.#show();
  }
}

function tool(what, sign, label, isOff = false) {
  return html`<button type="button" class="button button--small" data-do="${what}"
  ${(isOff || !mayEdit()) && 'disabled'}>${icon(sign)}${label}</button>`;
}

function step(what, sign, label, isOff) {
  return html`<button type="button" class="button button--small button--icon" data-do="${what}"
  title="${label}" aria-label="${label}" ${isOff && 'disabled'}>${icon(sign)}</button>`;
}

function markup(desk, item, photos, at, title, isBurntIn) {
  const { video } = desk.inspection.value;
  const { url, attachment, strokes, frame } = photos[at];
  /** The title has the place of the defect, which is not that of another frame. */
  const taken = frame === item.frame ? null : desk.track.row(frame);
  const isStored = attachment ? attachment.save === 'saved' : true;
  const alt = strokes.length ? t('attach.drawing_alt', { name: title }) : t('form.photo_alt', { name: title });
  const query = new URLSearchParams({ lang: language, units: lengthUnit, burnt_in: isBurntIn });
  const path = `/api/inspections/${desk.inspection.id}/photos/${photos[at].id}?${query}`;
  const isOne = photos.length === 1;
  const [isFirst, isLast] = [at === 0, at === photos.length - 1];
  return html`<div class="row wrap">
      ${!isOne && html`${step('before', 'back', t('attach.before'), isFirst)}${step('after', 'forward', t('attach.after'), isLast)}`}
      <span class="number">${t('attach.of', { n: at + 1, all: photos.length })}</span>
      <span class="dim number">${t('form.frame', { frame })}</span>
      ${taken && html`<span class="number">${t('attach.taken', { at: chainage(taken.distance_mm / 1000), time: timecode(taken.time_s) })}</span>`}
      ${isFirst && !isOne && html`<span class="chip">${t('attach.main')}</span>`}
      ${tool('draw', 'edit', strokes.length ? t('attach.redraw') : t('attach.draw'), !isStored)}
      ${
        !isOne &&
        html`${tool('main', 'flag', t('attach.make_main'), isFirst)}${tool('earlier', 'undo', t('attach.earlier'), isFirst)}
        ${tool('later', 'redo', t('attach.later'), isLast)}`
      }
      ${attachment && tool('delete', 'trash', t('attach.delete'))}
    </div>
    <div class="photo" data-part="picture">
      <img src="${url}" alt="${alt}" width="${squareOf(video).width}" height="${squareOf(video).height}" />
      ${!attachment && item.pixel && mark(item.pixel, video)}
      ${!attachment && measuresOnPhoto(item, video)}
      ${strokes.length > 0 && html`<canvas class="photo__strokes covers" data-part="strokes" aria-hidden="true"></canvas>`}
    </div>
    <div class="row wrap">
      <label class="switch row"><input type="checkbox" ${isBurntIn && 'checked'} />${t('attach.burnt_in')}</label>
      ${isStored && html`<a class="button button--small" href="${path}" download>${icon('download')}${t('form.photo_save')}</a>`}
    </div>`;
}

/** Pixel centres are integers, so the picture begins at -0.5. */
function mark(pixel, video) {
  const [u, v] = toSquare(video, pixel);
  const { width, height } = squareOf(video);
  const radius = width / 22;
  return html`<svg class="photo__mark covers" viewBox="-0.5 -0.5 ${width} ${height}" aria-hidden="true">
    ${['photo__edge', 'photo__line'].map(
      (line) => html`<g class="${line}"><circle cx="${u}" cy="${v}" r="${radius}" />
      <path d="M${u - radius} ${v}h${radius * 0.6}M${u + radius} ${v}h${-radius * 0.6}M${u} ${v - radius}v${radius * 0.6}M${u} ${v + radius}v${-radius * 0.6}" /></g>`,
    )}
  </svg>`;
}
