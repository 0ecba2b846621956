/**
 * Drawing on a copy of a photo: arrows, lines by hand, texts. With the keyboard, the arrow keys move a cross
 * over the picture, and Enter begins and ends a stroke.
 */

import { html } from '../../../core/page/html.js';
import { squareOf } from '../../../core/wall/pixels.js';
import { t, wordFor } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { COLOURS, paintStrokes } from './strokes.js';

const TOOLS = ['arrow', 'line', 'text'];
/** Points of a line closer than this, against the width of the picture, are left out. */
const LEAST_STEP = 1 / 400;
const MOST_POINTS = 2000;
const MOST_STROKES = 200;
/** Steps of the cross against the width of the picture, and with Shift. */
const STEP = 1 / 50;
const FINE_STEP = 1 / 400;
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * @param {import('./photos.js').Photo} photo
 * @param {import('../../../core/wall/pixels.js').Video} video
 * @param {string} title
 * @returns {Promise<object[]|null>} the strokes, null if nothing was changed
 */
export async function openDrawing(photo, video, title) {
  const square = squareOf(video);
  const { parts, closed } = openDialog({
    title: t('attach.draw_on', { name: title }),
    size: 'wide',
    content: markup(photo, square),
  });
  parts.picture.style.setProperty('--aspect', square.width / square.height);
  for (const { value, parentElement } of parts.tools.elements.colour) parentElement.style.background = COLOURS[value];
  const pad = new Pad(parts, photo.strokes, square);
  parts.canvas.focus();
  parts.done.addEventListener('click', () => parts.done.closest('dialog').close());
  await closed;
  const { strokes } = pad;
  const isChanged = JSON.stringify(strokes) !== JSON.stringify(photo.strokes);
  return isChanged && (strokes.length > 0 || photo.strokes.length > 0) ? strokes : null;
}

class Pad {
  strokes;
  #parts;
  #picture;
  /** The stroke that is being drawn, or null. */
  #open = null;
  /** The cross of the keyboard, or null while the pointer draws. */
  #cross = null;

  constructor(parts, strokes, picture) {
    this.#parts = parts;
    this.#picture = picture;
    this.strokes = [...strokes];
    const { canvas, undo, clear } = parts;
    canvas.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      canvas.setPointerCapture(event.pointerId);
      canvas.focus({ preventScroll: true });
      this.#cross = null;
      this.#begin(this.#pixelOf(event));
    });
    canvas.addEventListener('pointermove', (event) => this.#open && this.#extend(this.#pixelOf(event)));
    canvas.addEventListener('pointerup', () => this.#finish());
    canvas.addEventListener('pointercancel', () => this.#drop());
    canvas.addEventListener('keydown', (event) => this.#key(event));
    parts.tools.addEventListener('submit', (event) => event.preventDefault()); // Enter in the text field
    undo.addEventListener('click', () => this.#set(this.strokes.slice(0, -1)));
    clear.addEventListener('click', () => this.#set([]));
    this.#set(this.strokes);
  }

  #set(strokes) {
    this.strokes = strokes;
    this.#parts.undo.disabled = this.#parts.clear.disabled = strokes.length === 0;
    this.#paint();
  }

  #pixelOf({ clientX, clientY }) {
    const { width, height } = this.#picture;
    const box = this.#parts.canvas.getBoundingClientRect();
    const within = (share, size) => Math.round(10 * (Math.min(Math.max(share, 0), 1) * size - 0.5)) / 10;
    return [within((clientX - box.left) / box.width, width), within((clientY - box.top) / box.height, height)];
  }

  get #chosen() {
    const { elements } = this.#parts.tools;
    return { kind: elements.tool.value, colour: elements.colour.value, text: elements.text.value.trim() };
  }

  #begin(point) {
    if (this.strokes.length >= MOST_STROKES) return;
    const { kind, colour, text } = this.#chosen;
    if (kind !== 'text') {
      this.#open = { kind, points: [point], colour };
      return;
    }
    if (text) this.#set([...this.strokes, { kind, points: [point], colour, text }]);
    else this.#parts.tools.elements.text.focus();
  }

  #extend(point) {
    const { kind, points } = this.#open;
    const [u, v] = points.at(-1);
    if (kind === 'arrow') this.#open.points = [points[0], point];
    else if (points.length < MOST_POINTS && Math.hypot(point[0] - u, point[1] - v) > this.#picture.width * LEAST_STEP)
      points.push(point);
    this.#paint();
  }

  #finish() {
    const stroke = this.#open;
    this.#open = null;
    if (stroke && (stroke.kind !== 'arrow' || stroke.points.length === 2)) this.#set([...this.strokes, stroke]);
    else this.#paint();
  }

  #drop() {
    this.#open = null;
    this.#paint();
  }

  #key(event) {
    const { width, height } = this.#picture;
    const move = MOVES[event.key];
    if (event.key === 'Escape' && this.#open) {
      event.preventDefault();
      this.#drop();
    } else if (event.key === 'Enter') {
      event.preventDefault();
      this.#cross ??= [width / 2, height / 2];
      if (this.#open) this.#finish();
      else this.#begin(this.#cross);
      this.#paint();
    } else if (move) {
      event.preventDefault();
      const step = width * (event.shiftKey ? FINE_STEP : STEP);
      const [u, v] = this.#cross ?? [width / 2, height / 2];
      const held = (value, size) => Math.min(Math.max(Math.round(value), 0), size - 1);
      this.#cross = [held(u + move[0] * step, width), held(v + move[1] * step, height)];
      if (this.#open) this.#extend(this.#cross);
      this.#paint();
    }
    event.stopPropagation(); // the keys of the page belong to the film
  }

  #paint() {
    const { canvas } = this.#parts;
    paintStrokes(canvas, this.#open ? [...this.strokes, this.#open] : this.strokes, this.#picture);
    if (this.#cross) paintCross(canvas, this.#cross, this.#picture.width);
  }
}

function paintCross(canvas, [u, v], width) {
  const context = canvas.getContext('2d');
  const arm = width / 60;
  for (const [ink, wide] of /** @type {const} */ ([
    ['#000000', width / 200],
    ['#ffffff', width / 500],
  ])) {
    context.strokeStyle = ink;
    context.lineWidth = Math.max(1, wide);
    context.stroke(new Path2D(`M${u - arm} ${v}H${u + arm}M${u} ${v - arm}V${v + arm}`));
  }
}

const markup = ({ url }, { width, height }) => html`<form class="row wrap" data-part="tools">
    <fieldset class="flow gap-1"><legend class="visually-hidden">${t('attach.tools')}</legend>
      ${TOOLS.map((tool, i) => html`<label class="button button--small"><input type="radio" class="visually-hidden" name="tool" value="${tool}" ${i === 0 && 'checked'} />${wordFor('attach.tool', tool)}</label>`)}</fieldset>
    <fieldset class="flow gap-1"><legend class="visually-hidden">${t('attach.colours')}</legend>
      ${Object.keys(COLOURS).map(
        (
          colour,
          i,
        ) => html`<label class="drawing__colour" title="${wordFor('attach.colour', colour)}"><input type="radio"
        name="colour" value="${colour}" aria-label="${wordFor('attach.colour', colour)}" ${i === 0 && 'checked'} /></label>`,
      )}</fieldset>
    <input class="input drawing__text" name="text" maxlength="200" autocomplete="off" aria-label="${t('attach.text')}" placeholder="${t('attach.text')}" />
    <button type="button" class="button button--small" data-part="undo">${icon('undo')}${t('attach.undo_stroke')}</button>
    <button type="button" class="button button--small" data-part="clear">${icon('trash')}${t('attach.clear')}</button>
    <button type="button" class="button button--small button--primary" data-part="done">${icon('check')}${t('form.done')}</button>
  </form>
  <div class="photo" data-part="picture">
    <img src="${url}" alt="" width="${width}" height="${height}" draggable="false" />
    <canvas class="photo__strokes covers drawing__pad" width="${width}" height="${height}" tabindex="0" role="application" aria-label="${t('attach.pad')}" data-part="canvas"></canvas>
  </div>
  <p class="help">${t('attach.draw_help')}</p>`;
