/**
 * The rig: camera and mount of the library by their name, presets, a rig.json, or by hand, checked while typing.
 *
 * `value` is the rig in the form of the API, `check()` shows every fault and returns whether there is none.
 * Event `rig`: a value has changed. Event `named`: its name in the library, '' if it has none, is the
 * detail.
 *
 * A page that asks for the pipe elsewhere sets `pipe`: these fields are not asked here then. Event `pipe`: something
 * here states one of them (detail {values, isTyped}: by path; a person typed it, or a file or preset has it). Event
 * `elsewhere`: one has a fault (detail {path, reason}). Event `again`: the last camera is taken (detail: what was kept
 * beside it).
 */

import { get } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { resized } from '../../../core/wall/lens.js';
import { recall, remember } from '../../../core/page/remembered.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { ALL_FIELDS, EXPERT, GROUPS, LENS_PX, fault, jointFaults, parse, setAt, turned, valueAt } from './fields.js';
import { askBoard } from './board-dialog.js';
import './known-by.js';
import './lens-fields.js';
import './rig-picture.js';
import { openRigLibrary } from './rig-library.js';
import { rigSketch } from './rig-sketch.js';

/** Camera and mount of the last inspection, which are offered by their name, never filled in. */
const LAST = 'chainage.rig.last';
const OF_A_PIPE = [
  'pipe.diameter_mm',
  'pipe.corrugation.pitch_mm',
  'pipe.corrugation.depth_mm',
  'tolerance.diameter_mm',
];
/** fy / fx of a lens may differ from what its film states by this share: digitisers of television round it. */
const PIXELS_DIFFER = 0.03;
const idOf = (path) => `rig-${path.replaceAll('.', '-')}`;

export class RigForm extends Component {
  #touched = new Set();
  /** @type {[number, number]|null} */
  /** @type {import('../../../core/wall/pixels.js').Video|null} */
  #video = null;
  #presets = [];
  /** Rigs of the library. */
  #library = [];
  /** Under which the rig was taken from the library or kept there. */
  #name = '';
  /** Camera and mount that were kept. @type {Record<string, any>|null} */
  #last = null;
  /** What is stated of the pipe elsewhere, by path; '' where it is missing. */
  #pipe = {};

  mount() {
    /** @type {Parts<'rig-form/rig-form'>} */
    this.parts = render(
      this,
      html`<p class="below-4" data-part="offer" hidden><button type="button" class="button" data-part="again">${icon('retry')}<span data-part="last"></span></button></p>
        <div class="rig__source flow gap-3 at-bottom below-4">
          <div class="field">
            <label for="rig-preset">${t('rig.start_from')}</label>
            <select class="input" id="rig-preset" data-part="source"><option value="">${t('rig.choose')}</option>
              <optgroup label="${t('library.title')}" data-part="named" hidden></optgroup>
              <optgroup label="${t('rig.presets')}" data-part="presets"></optgroup></select>
          </div>
          <button type="button" class="button" data-part="library">${icon('layers')}${t('library.open')}</button>
          <button type="button" class="button" data-part="pick">${icon('upload')}${t('rig.load')}</button>
          <input type="file" accept=".json,application/json" data-part="file" hidden />
        </div>
        <p class="fault" role="alert" data-part="loadFault"></p>
        <p class="weak" role="status" data-part="otherPipe"></p>
        <div class="rig__body one-if-narrow stack gap-5">
          <div class="stack gap-5 packed">
            ${GROUPS.map(
              ({ name, title, fields }) => html`<fieldset class="rig__group rig__group--${name}">
              <legend>${title}</legend>
              ${name === 'pipe' && html`<p class="help below-3" data-part="stated" hidden></p>`}
              ${
                name === 'camera' &&
                html`<lens-fields data-part="lens"></lens-fields>
                <button type="button" class="button button--small below-4" data-part="board">${icon('layers')}${t('board.open')}</button>`
              }
              <div class="rig__grid fields gap-4">${fields.map(fieldMarkup)}</div>
            </fieldset>`,
            )}
            <p class="message rig__resize" data-part="resize" hidden>${icon('info')}
              <button type="button" class="button button--small" data-part="take">${t('rig.take_size')}</button></p>
            <p class="message" role="status" data-part="pixels" hidden></p>
            <known-by data-part="known"></known-by>
            <details class="rig__expert" data-part="expert"><summary>${t('rig.expert')}</summary>
              <div class="stack gap-5">${EXPERT.map(
                ({ name, title, help, fields }) => html`<fieldset class="rig__group rig__group--${name}">
                <legend>${title}</legend>
                ${help && html`<p class="help below-3">${help}</p>`}
                <div class="rig__grid fields gap-4">${fields.map(fieldMarkup)}</div></fieldset>`,
              )}</div></details>
          </div>
          <div class="rig__side">
            <rig-picture data-part="picture"></rig-picture>
            <figure class="rig__sketch">
              <div data-part="sketch"></div>
              <figcaption class="help">${t('rig.sketch_help')}</figcaption>
            </figure>
          </div>
        </div>`,
    );
    this.listen(this, 'input', (event) => this.#typed(event.target));
    this.listen(this, 'change', (event) => this.#left(event.target));
    this.listen(this.parts.source, 'change', () => this.#chooseSource());
    this.listen(this.parts.again, 'click', () => this.#takeLast());
    this.listen(this.parts.pick, 'click', () => this.parts.file.click());
    this.listen(this.parts.file, 'change', () => this.#readFile());
    const { lens, picture, known, take } = this.parts;
    this.listen(lens, 'lens', ({ detail }) => this.change(detail));
    this.listen(lens, 'mode', () => {
      this.parts.expert.open ||= lens.mode === 'px'; // its fields are there
      this.#showFaults();
    });
    this.listen(known, 'known', ({ detail }) => this.change(detail));
    this.listen(picture, 'turn', ({ detail }) => this.#turn(detail));
    this.listen(this.parts.library, 'click', () => this.#openLibrary());
    this.listen(this.parts.board, 'click', () => this.#calibrate());
    this.listen(take, 'click', () => this.#takeSize());
    this.#fill({});
    this.#loadSources();
  }

  /** The present rig, without empty fields. @returns {Record<string, any>} */
  get value() {
    const rig = { camera: {}, mount: {}, pipe: {}, tolerance: {} };
    for (const field of ALL_FIELDS) {
      const value = this.#isUsed(field) ? parse(field, this.#input(field).value) : undefined;
      if (value !== undefined) setAt(rig, field.path, value);
    }
    return rig;
  }

  set value(rig) {
    this.#fill(rig);
  }

  /** Sets some fields by their paths, such as 'pipe.diameter_mm'; '' empties one. */
  change(values) {
    const own = Object.entries(values).filter(([path]) => !(path in this.#pipe));
    const elsewhere = Object.entries(values).filter(([path]) => path in this.#pipe);
    for (const [path, value] of own) this.#input({ path }).value = value;
    this.#changed();
    this.#statePipe(Object.fromEntries(elsewhere), true);
  }

  /** What is stated of the pipe elsewhere on the page, by path; '' where it is missing. @param {Record<string, any>} stated */
  set pipe(stated) {
    if (JSON.stringify(stated) === JSON.stringify(this.#pipe)) return;
    this.#pipe = stated;
    this.#fillPipe();
    this.#changed();
  }

  #fillPipe() {
    for (const [path, value] of Object.entries(this.#pipe)) this.#input({ path }).value = value;
    const { pipe } = this.value;
    this.parts.stated.hidden = !('pipe.diameter_mm' in this.#pipe || 'pipe.shape' in this.#pipe);
    this.parts.stated.textContent = t('rig.pipe_of_header', {
      pipe: [
        pipe.shape === 'circular' ? `Ø ${pipe.diameter_mm ?? '?'} mm` : t('rig.shape_flat'),
        pipe.segment_length_mm && t('rig.pipe_units', { mm: pipe.segment_length_mm }),
      ]
        .filter(Boolean)
        .join(', '),
    });
  }

  /** Says what is stated here of the pipe that is asked for elsewhere, where it differs. */
  #statePipe(values, isTyped) {
    const other = Object.entries(values).filter(([path, value]) => String(this.#pipe[path]) !== String(value ?? ''));
    const detail = { values: Object.fromEntries(other), isTyped };
    if (other.length) this.dispatchEvent(new CustomEvent('pipe', { detail }));
    const left = other.filter(([path, value]) => value !== '' && String(this.#pipe[path]) !== String(value));
    this.parts.otherPipe.textContent =
      isTyped || !left.length ? '' : t('rig.pipe_differs', { values: left.map(([, value]) => `${value}`).join(', ') });
  }

  /** The chosen film, whose size is compared with the camera's; null when unknown. */
  set video(video) {
    this.#video = video;
    this.#adoptSize();
    this.#changed();
  }

  /** Address of a picture of the film, on which the wall is drawn; null when there is none yet. */
  set picture(address) {
    this.parts.picture.source = address;
  }

  /** Shows every fault; returns whether the rig can be used, and focuses the first fault if not. */
  check() {
    for (const { path } of ALL_FIELDS) this.#touched.add(path);
    const first = this.#showFaults();
    if (first && first.path in this.#pipe) {
      const detail = { path: first.path, reason: fault(first, valueAt(this.value, first.path)) };
      this.dispatchEvent(new CustomEvent('elsewhere', { detail }));
    } else if (first) {
      if (EXPERT.some(({ fields }) => fields.includes(first)) && this.#isShown(first)) this.parts.expert.open = true;
      if (this.#isShown(first)) this.#input(first).focus();
      else this.parts.lens.focus();
    }
    return !first;
  }

  /** Shows a group of fields and focuses the first one. @param {string} name of one of GROUPS */
  goTo(name) {
    const group = this.querySelector(`.rig__group--${name}`);
    group.scrollIntoView();
    group.querySelector('input, select').focus();
  }

  /**
   * Keeps camera and mount, to be offered for the next inspection.
   * @param {string} title of the inspection, where they have no name
   * @param {object} beside what belongs to them elsewhere on the page
   */
  remember(title, beside) {
    const { camera, mount, tolerance } = this.value;
    remember(LAST, { name: this.#name, title, camera, mount, tolerance, lens: this.parts.lens.mode, beside });
  }

  /** Offers the camera and mount of the last inspection. */
  offerLast() {
    const last = recall(LAST, null);
    this.#last = last;
    this.parts.offer.hidden = last === null;
    if (last)
      this.parts.last.textContent = t('rig.again', { name: last.name || t('rig.camera_of', { name: last.title }) });
  }

  #takeLast() {
    const { name, camera, mount, tolerance, lens, beside } = this.#last;
    this.#fill({ camera, mount, tolerance, pipe: this.value.pipe });
    this.parts.lens.mode = lens;
    this.#showFaults();
    this.parts.offer.hidden = true;
    this.parts.source.focus(); // the button is gone
    this.dispatchEvent(new CustomEvent('again', { detail: beside }));
    this.#call(name);
  }

  /** The rig has this name in the library, '' where it is not from there. */
  #call(name) {
    this.#name = name;
    this.#showName();
    this.dispatchEvent(new CustomEvent('named', { detail: name }));
  }

  #showName() {
    const at = this.#library.findIndex(({ name }) => name === this.#name);
    if (at >= 0) this.parts.source.value = `named ${at}`;
  }

  /** A rig is taken from the library, or the present one is kept there. */
  async #openLibrary() {
    const taken = await openRigLibrary(this.#showFaults() ? null : this.value, this.#name);
    this.#loadLibrary();
    if (taken) this.#take(taken);
  }

  /** Takes a rig of the library; a pipe that is stated elsewhere stays. */
  #take({ name, rig }) {
    const isOwn = Object.keys(this.#pipe).length === 0;
    const taken = isOwn ? rig : { ...rig, pipe: this.value.pipe };
    if (JSON.stringify(taken) !== JSON.stringify(this.value)) this.#fill(taken);
    this.#call(name);
  }

  /** The lens is measured with a board. */
  async #calibrate() {
    const found = await askBoard(this.value.camera.model);
    if (!found) return;
    const { distortion, ...camera } = found.camera;
    const values = Object.entries(camera).map(([name, value]) => [`camera.${name}`, value]);
    this.parts.lens.mode = 'px';
    this.change({
      ...Object.fromEntries(values),
      'camera.distortion': distortion.join(', '),
      'tolerance.focal_percent': found.focal_percent,
    });
  }

  async #loadSources() {
    const { presets } = await get('/api/presets', this.signal);
    this.#presets = presets;
    this.parts.presets.append(...presets.map(({ name }, i) => new Option(name, `preset ${i}`)));
    await this.#loadLibrary();
  }

  async #loadLibrary() {
    const { rigs } = await get('/api/rigs', this.signal);
    this.#library = rigs;
    this.parts.named.replaceChildren(...rigs.map(({ name }, i) => new Option(name, `named ${i}`)));
    this.parts.named.hidden = rigs.length === 0;
    this.#showName();
  }

  #chooseSource() {
    const [kind, at] = this.parts.source.value.split(' ');
    if (kind === 'named') this.#take(this.#library[at]);
    if (kind !== 'preset') return;
    const { rig } = this.#presets[at];
    this.#fill(rig);
    this.#call('');
    // Which unit length a pipe has is measured by its joints: nobody's guess.
    this.#statePipe(pathsOf(rig.pipe, ['shape', 'diameter_mm']), false);
  }

  async #readFile() {
    const [file] = this.parts.file.files;
    this.parts.file.value = '';
    if (!file) return;
    let rig;
    try {
      rig = JSON.parse(await file.text());
    } catch (error) {
      if (!(error instanceof SyntaxError)) throw error;
      this.parts.loadFault.textContent = t('rig.not_json', { file: file.name });
      return;
    }
    const missing = ['camera', 'mount', 'pipe'].filter((part) => typeof rig?.[part] !== 'object');
    if (missing.length) {
      this.parts.loadFault.textContent = t('rig.not_a_rig', {
        file: file.name,
        missing: missing.join(t('rig.not_a_rig_and')),
      });
      return;
    }
    this.parts.source.value = '';
    this.#fill(rig);
    this.#call('');
    this.#statePipe(pathsOf(rig.pipe, ['shape', 'diameter_mm', 'segment_length_mm']), false);
    this.check();
  }

  #fill(rig) {
    this.parts.loadFault.textContent = '';
    this.#touched.clear();
    for (const field of ALL_FIELDS) {
      const value = valueAt(rig, field.path);
      const input = this.#input(field);
      if (value !== undefined && value !== null) input.value = [value].flat().join(', ');
      else input.value = field.kind === 'choice' ? field.options[0][0] : '';
    }
    this.parts.lens.mode = rig.camera?.fx ? 'px' : 'angle';
    this.#fillPipe();
    this.#adoptSize();
    this.#changed();
  }

  /** Takes the size of the film's picture over, unless it was stated with a lens in px. */
  #adoptSize() {
    const { width, height } = this.value.camera;
    if (!this.#video || (this.parts.lens.mode === 'px' && (width || height))) return;
    for (const side of ['width', 'height']) this.#input({ path: `camera.${side}` }).value = this.#video[side];
  }

  /** Takes the film's size over with a lens in px: a smaller film of the same camera. */
  #takeSize() {
    const camera = resized(this.value.camera, this.#video.width, this.#video.height);
    this.change(Object.fromEntries(Object.entries(camera).map(([name, value]) => [`camera.${name}`, value])));
  }

  #turn(degrees) {
    this.change({ 'mount.rotation_deg': turned(this.value.mount.rotation_deg ?? 0, degrees) });
  }

  #typed(input) {
    if (!input.dataset.path) return;
    // A shown fault disappears as soon as it is fixed, not only on leaving the field.
    this.#changed();
  }

  #left(input) {
    if (!input.dataset.path) return;
    this.#touched.add(input.dataset.path);
    this.#changed();
  }

  #changed() {
    const rig = this.value;
    this.parts.lens.camera = { ...rig.camera, pixel_aspect: this.#video?.pixel_aspect };
    this.parts.known.tolerance = rig.tolerance;
    this.parts.picture.rig = this.#showFaults() ? null : rig;
    render(this.parts.sketch, rigSketch(rig));
    this.dispatchEvent(new Event('rig'));
  }

  /** Shows the faults of touched fields beside them; returns the first faulty field or null. */
  #showFaults() {
    const rig = this.value;
    const faults = new Map(jointFaults(rig));
    for (const field of ALL_FIELDS) {
      const reason = this.#isUsed(field) ? fault(field, valueAt(rig, field.path)) : null;
      if (reason) faults.set(field.path, reason);
    }
    this.#compareWithVideo(rig.camera, faults);
    this.#comparePixels(rig.camera);
    for (const field of ALL_FIELDS) {
      const reason = this.#touched.has(field.path) ? (faults.get(field.path) ?? '') : '';
      const input = this.#input(field);
      input.setAttribute('aria-invalid', String(reason !== ''));
      input.closest('.field').querySelector('.fault').textContent = reason;
      input.closest('.field').hidden = !this.#isShown(field);
    }
    this.querySelector('.rig__group--lens').hidden = this.parts.lens.mode !== 'px';
    const lensFaults = LENS_PX.filter((path) => this.#touched.has(path)).map((path) => faults.get(path));
    this.parts.lens.fault = (this.parts.lens.mode !== 'px' && lensFaults.find(Boolean)) || '';
    return ALL_FIELDS.find(({ path }) => faults.has(path)) ?? null;
  }

  #compareWithVideo({ width, height }, faults) {
    this.parts.resize.hidden = true;
    if (!this.#video || faults.has('camera.width') || faults.has('camera.height')) return;
    const { width: videoWidth, height: videoHeight } = this.#video;
    if (width === videoWidth && height === videoHeight) return;
    faults.set('camera.width', t('rig.video_size', { width: videoWidth, height: videoHeight }));
    this.#touched.add('camera.width');
    this.parts.resize.hidden = !isSameShape(width / height, videoWidth / videoHeight);
  }

  /** A film may state the shape of its pixels; a lens that was measured may know it better. */
  #comparePixels({ fx, fy }) {
    const aspect = this.#video?.pixel_aspect ?? 1;
    const isAsStated = aspect === 1 || !(fx > 0 && fy > 0) || Math.abs(fy / fx / aspect - 1) < PIXELS_DIFFER;
    this.parts.pixels.hidden = isAsStated;
    if (isAsStated) return;
    const found = { aspect: aspect.toFixed(3), ratio: (fy / fx).toFixed(3) };
    render(this.parts.pixels, html`${icon('info')}<span>${t('rig.pixels', found)}</span>`);
  }

  #isUsed({ path }) {
    return !OF_A_PIPE.includes(path) || this.#input({ path: 'pipe.shape' }).value === 'circular';
  }

  #isShown(field) {
    if (field.path in this.#pipe) return false;
    return this.#isUsed(field) && (this.parts.lens.mode === 'px' || !LENS_PX.includes(field.path));
  }

  #input({ path }) {
    return this.querySelector(`#${idOf(path)}`);
  }
}

/** Returns members of a pipe by their paths. */
const pathsOf = (pipe, names) => Object.fromEntries(names.map((name) => [`pipe.${name}`, pipe[name] ?? '']));

/** Pixels are whole, so equal shapes differ a little. */
const isSameShape = (shape, other) => Math.abs(shape / other - 1) < 0.005;

/** @param {import('./fields.js').Field} field */
function fieldMarkup({ path, kind, label, unit, optional, help, options }) {
  const id = idOf(path);
  const described = `${id}-fault${help ? ` ${id}-help` : ''}`;
  const control =
    kind === 'choice'
      ? html`<select class="input" id="${id}" data-path="${path}" aria-describedby="${described}">
          ${options.map(([value, text]) => html`<option value="${value}">${text}</option>`)}</select>`
      : html`<span class="input-with-unit">
          <input class="input" id="${id}" data-path="${path}" aria-describedby="${described}" autocomplete="off"
            inputmode="${kind === 'numbers' ? 'text' : 'decimal'}" />
          ${unit && html`<span class="unit">${unit}</span>`}</span>`;
  return html`<div class="field${kind === 'numbers' && ' field--wide'}">
    <label for="${id}">${label}${optional && html` <span class="required">${t('page.optional')}</span>`}</label>
    ${control}
    <span class="fault" id="${id}-fault"></span>
    ${help && html`<span class="help" id="${id}-help">${help}</span>`}
  </div>`;
}

customElements.define('rig-form', RigForm);
