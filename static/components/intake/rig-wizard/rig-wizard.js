/**
 * The rig of a camera that looks along the pipe, asked on a picture of its film: "Is this the axis?" and "How wide
 * is the pipe?". What is answered goes into the rig form at once. Of a film that becomes an inspection a third
 * picture asks "Is there a counter?"; the answer is `counter`.
 *
 * It begins with the picture that shows the axis for certain, and proposes the axis in it. Where none does, it
 * proposes nothing: the cross is where the rig has the axis until somebody moves it.
 *
 * Set `rig` to that form, and `film` to the address of an upload or an inspection on the server, or to null.
 */

import { get, post, refusalIn } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { focalDown } from '../../../core/wall/lens.js';
import { newest } from '../../../core/server/newest.js';
import { squareOf } from '../../../core/wall/pixels.js';
import { timecode } from '../../../core/wall/units.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import './counter-step.js';
import { changesFor, statedOf } from './guess.js';

const STEPS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
const LONG_STEP_PX = 10;
/** Smaller differences to the pitch of the rig before are no news. */
const RIG_DIFFERS_DEG = 3;
const STEPS_OF_WIZARD = ['axis', 'width', 'counter'];

/** @typedef {[u: number, v: number]} Pixel of the film */

export class RigWizard extends Component {
  #rig = null;
  /** @type {string|null} */
  #film = null;
  /** The shown picture, and the axis that is certain in it; null while it is closed. @type {Api['AxisOut']|null} */
  #seen = null;
  /** The cross; null until the axis is found or the cross is moved: then the rig says where it looks. */
  #axis = null;
  /** Where the present rig has the axis. @type {Pixel|null} */
  #ofRig = null;
  /** Where the rig of an inspection had the axis when the wizard was opened. @type {{axis: Pixel|null, pitch: number}|null} */
  #before = null;
  #isLensGuessed = false;
  /** What was answered about the counter; null: nobody has, so it is searched. */
  #counter = null;
  /** Asks where the camera looks, and for the wall. */
  #aim = newest(() => this.#askAim());

  mount() {
    /** @type {Parts<'rig-wizard/rig-wizard'>} */
    this.parts = render(
      this,
      html`<div class="row gap-row wrap">
          <p>${t('wizard.intro')}</p>
          <button type="button" class="button" data-part="open">${icon('video')}${t('wizard.open')}</button>
          <p class="help" data-part="needs">${t('wizard.needs_film')}</p>
        </div>
        <p class="fault" role="alert" data-part="fault"></p>
        <div data-part="body"></div>`,
    );
    this.listen(this.parts.open, 'click', () => this.open());
    this.#showAsk();
  }

  set rig(form) {
    this.#rig = form;
    this.listen(form, 'rig', () => this.#rigChanged());
  }

  /** What is stated about the burnt-in counter of the film, for the server; null: nothing. */
  get counter() {
    return this.#counter;
  }

  set film(address) {
    if (address === this.#film) return;
    this.#film = address;
    if (address === null) this.#counter = null; // the next film may be another one
    this.#close();
  }

  /** Whether the film is not an inspection yet. */
  get #isUpload() {
    return this.#film?.startsWith('/api/uploads/') ?? false;
  }

  #showAsk() {
    this.parts.open.disabled = this.#film === null;
    this.parts.needs.hidden = this.#film !== null;
    setText(this.parts.needs, t('wizard.needs_film'));
  }

  #close() {
    this.#seen = null;
    this.parts.fault.textContent = '';
    render(this.parts.body, html``);
    this.#showAsk();
  }

  /** Opens it on the picture that shows the axis best. @param {'axis'|'width'} [step] */
  async open(step = 'axis') {
    const { open, fault, needs } = this.parts;
    open.disabled = true;
    fault.textContent = '';
    needs.hidden = false;
    setText(needs, t('wizard.looking'));
    await this.#look(null, async (seen) => {
      const { changes, isLensGuessed } = changesFor(this.#rig.value, seen);
      this.#rig.change(changes);
      this.#isLensGuessed = isLensGuessed;
      const { axis, pitch_deg: pitch } = await this.#aimed(null);
      this.#before = this.#isUpload ? null : { axis, pitch };
      this.#ofRig = axis;
      this.#seen = seen;
      this.#axis = seen.axis;
      this.#draw();
      this.#showStep(step);
    });
    this.#showAsk();
  }

  /**
   * Looks for the axis in a picture of the film.
   * @param {number|null} timeS null: where it shows best
   * @param {(seen: Api['AxisOut']) => void|Promise<void>} then
   */
  async #look(timeS, then) {
    const film = this.#film;
    try {
      const seen = await get(`${film}/axis${timeS === null ? '' : `?time_s=${timeS}`}`, this.signal);
      if (film === this.#film) await then(seen);
    } catch (error) {
      if (!refusalIn(error)) return;
      this.parts.fault.textContent = errorText(error);
    }
  }

  /** Shows the picture of another time; the rig stays as it is unless the axis is certain there. @param {number} timeS */
  #showTime(timeS) {
    return this.#look(timeS, (seen) => {
      if (!this.#seen) return;
      this.#seen = { ...seen, looked_at: this.#seen.looked_at, sure: this.#seen.sure };
      this.#axis = seen.axis;
      this.#showPicture();
      this.#rigChanged();
    });
  }

  #draw() {
    const { width, height } = this.#seen;
    const shown = squareOf(this.#seen);
    const hasCounter = this.#isUpload;
    this.parts.body.replaceChildren();
    const inside = render(
      this.parts.body,
      html`<div class="wizard stack gap-3 one-column pad-4" role="group" aria-label="${t('wizard.open')}">
        <ol class="wizard__steps flow">
          <li><button type="button" class="wizard__step tile row" data-part="toAxis"><b>1</b>${t('wizard.axis')}</button></li>
          <li><button type="button" class="wizard__step tile row" data-part="toWidth"><b>2</b>${t('wizard.width')}</button></li>
          <li ${!hasCounter && 'hidden'}><button type="button" class="wizard__step tile row" data-part="toCounter"><b>3</b>${t('wizard.counter')}</button></li>
        </ol>
        <counter-step class="stack gap-3 one-column" data-part="counter" hidden></counter-step>
        <div class="wizard__picture stage-of-picture" data-part="picture">
          <img width="${shown.width}" height="${shown.height}" alt="${t('wizard.picture')}" data-part="image" />
          <svg class="wizard__drawing covers" preserveAspectRatio="none" viewBox="-0.5 -0.5 ${width} ${height}" data-part="drawing">
            <path class="wizard__line" data-part="generators" />
            <path class="wizard__line wizard__line--ring" data-part="rings" />
            <path class="wizard__line wizard__line--before" data-part="before" />
            <circle class="wizard__line wizard__line--within" data-part="within" />
            <g class="wizard__cross" data-part="cross" tabindex="0" role="slider" aria-valuemin="0"
              aria-valuemax="${width - 1}" aria-label="${t('wizard.cross')}" aria-describedby="wizard-help">
              <circle r="${width / 40}" />
              <path d="M${-width / 20} 0H${width / 20}M0 ${-width / 20}V${width / 20}" />
            </g>
          </svg>
        </div>
        <div class="row gap-3 wizard__time" data-part="timeRow">
          <label for="wizard-time">${t('wizard.time')}</label>
          <input type="range" class="grow" id="wizard-time" min="0" step="any" data-part="time" />
          <span class="number" data-part="timeSaid"></span>
        </div>
        <p class="number" role="status" data-part="said"></p>
        <p class="help" id="wizard-help" data-part="help"></p>
        <div class="fields gap-4" data-part="fields">
          ${field('diameter', t('wizard.diameter'), 'mm')}
          ${field('height', t('wizard.height'), 'mm')}
          ${field('focal', t('wizard.focal'), 'px')}
          ${field('pitch', t('rig.corrugation_pitch'), 'mm')}
          ${field('depth', t('rig.corrugation_depth'), 'mm')}
        </div>
        <p class="message" data-part="guessed">${icon('info')}<span>${t('wizard.guessed')}</span></p>
        <div class="flow">
          <button type="button" class="button button--small" data-part="again">${icon('retry')}${t('wizard.again')}</button>
          <button type="button" class="button button--small" data-part="yes">${icon('check')}${t('wizard.yes')}</button>
          <button type="button" class="button button--small" data-part="next">${icon('check')}${t('wizard.next')}</button>
          <button type="button" class="button button--small" data-part="done">${icon('check')}${t('wizard.done')}</button>
        </div>
      </div>`,
    );
    Object.assign(this.parts, inside);
    const { drawing, cross } = inside;
    this.listen(drawing, 'pointerdown', (event) => {
      if (this.#step !== 'axis' || event.button !== 0) return;
      event.preventDefault(); // no drag of the picture
      drawing.setPointerCapture(event.pointerId);
      cross.focus();
      this.#moveTo(this.#pixelAt(event));
    });
    this.listen(drawing, 'pointermove', (event) => {
      if (drawing.hasPointerCapture(event.pointerId)) this.#moveTo(this.#pixelAt(event));
    });
    this.listen(cross, 'keydown', (event) => this.#key(event));
    this.listen(inside.toAxis, 'click', () => this.#showStep('axis'));
    this.listen(inside.toWidth, 'click', () => this.#showStep('width'));
    for (const to of [inside.toCounter, inside.next]) this.listen(to, 'click', () => this.#showStep('counter'));
    inside.next.hidden = !hasCounter;
    if (hasCounter) inside.counter.film = { ...this.#seen, address: this.#film };
    this.listen(inside.counter, 'answer', ({ detail }) => (this.#counter = detail));
    this.listen(inside.yes, 'click', () => {
      this.#showStep('width');
      this.parts.diameter.focus();
    });
    this.listen(inside.again, 'click', () => this.#moveTo(this.#seen.axis));
    inside.time.max = String(this.#seen.duration_s ?? 0);
    this.listen(inside.time, 'input', () => setText(inside.timeSaid, timecode(Number(inside.time.value), 1)));
    this.listen(inside.time, 'change', () => this.#showTime(this.#timeOf(Number(inside.time.value))));
    this.#showPicture();
    this.listen(inside.done, 'click', () => {
      this.#close();
      this.parts.open.focus();
    });
    this.listen(inside.diameter, 'input', () => this.#typedDiameter());
    this.listen(inside.height, 'input', () => this.#rig.change({ 'mount.height_mm': inside.height.value }));
    for (const name of ['pitch', 'depth']) {
      const path = `pipe.corrugation.${name}_mm`;
      this.listen(inside[name], 'input', () => this.#rig.change({ [path]: inside[name].value }));
    }
    this.listen(inside.focal, 'input', () => {
      const focal = Number(inside.focal.value.replace(',', '.'));
      const down = focal > 0 ? focalDown(focal, this.#seen.pixel_aspect) : inside.focal.value;
      this.#rig.change({ 'camera.fx': inside.focal.value, 'camera.fy': down });
    });
  }

  get #step() {
    return STEPS_OF_WIZARD.find((step) => this.#buttonOf(step).getAttribute('aria-current'));
  }

  #buttonOf(step) {
    return { axis: this.parts.toAxis, width: this.parts.toWidth, counter: this.parts.toCounter }[step];
  }

  /** @param {'axis'|'width'|'counter'} step */
  #showStep(step) {
    const { parts } = this;
    const [isAxis, isWidth, isCounter] = STEPS_OF_WIZARD.map((name) => name === step);
    for (const name of STEPS_OF_WIZARD) this.#buttonOf(name).removeAttribute('aria-current');
    this.#buttonOf(step).setAttribute('aria-current', 'step');
    parts.drawing.classList.toggle('wizard__drawing--axis', isAxis);
    parts.cross.setAttribute('tabindex', isAxis ? '0' : '-1');
    parts.help.textContent = isAxis ? t('wizard.axis_help') : t('wizard.width_help');
    parts.picture.hidden = parts.said.hidden = parts.help.hidden = isCounter;
    parts.timeRow.hidden = isCounter || !this.#seen.duration_s;
    parts.fields.hidden = !isWidth;
    parts.next.hidden = !isWidth || parts.toCounter.closest('li').hidden;
    parts.done.hidden = isAxis;
    parts.guessed.hidden = !isWidth || !this.#isLensGuessed;
    parts.yes.hidden = !isAxis;
    this.#showAgain();
    parts.counter.hidden = !isCounter;
    if (isCounter) parts.counter.open();
    this.#rigChanged();
  }

  #showPicture() {
    const { image, time, timeSaid, within } = this.parts;
    const { time_s: timeS, axis, axis_u95_px: u95 } = this.#seen;
    image.src = `${this.#film}/picture?time_s=${timeS}`;
    time.value = String(timeS);
    setText(timeSaid, timecode(timeS, 1));
    const circle = { cx: axis?.[0] ?? 0, cy: axis?.[1] ?? 0, r: axis ? u95 : 0 };
    for (const [name, value] of Object.entries(circle)) within.setAttribute(name, value);
    this.#showAgain();
  }

  #showAgain() {
    this.parts.again.hidden = this.#step !== 'axis' || !this.#seen.axis;
  }

  /** The last frame begins before the end of the film. @param {number} timeS */
  #timeOf(timeS) {
    return Math.min(timeS, 0.98 * this.#seen.duration_s);
  }

  /** @returns {[number, number]} */
  #pixelAt({ clientX, clientY }) {
    const { width, height } = this.#seen;
    const box = this.parts.drawing.getBoundingClientRect();
    return [((clientX - box.left) / box.width) * width - 0.5, ((clientY - box.top) / box.height) * height - 0.5];
  }

  #key(event) {
    const step = STEPS[event.key];
    if (!step) return;
    event.preventDefault();
    const px = event.shiftKey ? LONG_STEP_PX : 1;
    const [u, v] = this.#cross;
    this.#moveTo([u + px * step[0], v + px * step[1]]);
  }

  /** Where the cross is: on the axis, or else where the rig has it, or in the middle. @returns {Pixel} */
  get #cross() {
    const { width, height } = this.#seen;
    return this.#axis ?? this.#ofRig ?? [(width - 1) / 2, (height - 1) / 2];
  }

  #moveTo([u, v]) {
    const { width, height } = this.#seen;
    this.#axis = [Math.min(Math.max(u, 0), width - 1), Math.min(Math.max(v, 0), height - 1)];
    this.#showCross();
    this.#rigChanged();
  }

  /** A lens in the middle is likelier than any other place. */
  #typedDiameter() {
    const { diameter, height } = this.parts;
    const before = this.#rig.value.pipe.diameter_mm;
    const changes = { 'pipe.diameter_mm': diameter.value };
    if (!height.value || Number(height.value) === before / 2) {
      changes['mount.height_mm'] = Number(diameter.value) > 0 ? Number(diameter.value) / 2 : '';
    }
    this.#rig.change(changes);
  }

  #rigChanged() {
    if (!this.#seen) return;
    const { camera, mount, pipe } = this.#rig.value;
    const { parts } = this;
    const { pitch_mm: pitch, depth_mm: depth } = pipe.corrugation ?? {};
    const shown = { diameter: pipe.diameter_mm, height: mount.height_mm, focal: camera.fx, pitch, depth };
    for (const [name, value] of Object.entries(shown)) {
      if (parts[name] !== document.activeElement) parts[name].value = Number.isFinite(value) ? value : '';
    }
    this.#aim();
  }

  #showCross() {
    const [u, v] = this.#cross;
    const { cross, before } = this.parts;
    const arm = this.#seen.width / 20;
    const was = this.#axis && this.#before?.axis;
    before.setAttribute('d', was ? crossAt(was, arm) : '');
    cross.setAttribute('transform', `translate(${u} ${v})`);
    cross.setAttribute('aria-valuenow', Math.round(u));
    cross.setAttribute('aria-valuetext', t('wizard.cross_at', { u: Math.round(u), v: Math.round(v) }));
  }

  /** @param {Pixel|null} axis null: where the rig has it @returns {Promise<any>} */
  #aimed(axis) {
    return post('/api/aim', { rig: statedOf(this.#rig.value), axis }, this.signal);
  }

  async #askAim() {
    if (!this.#seen) return;
    try {
      const aim = await this.#aimed(this.#axis);
      if (this.#seen) this.#show(aim);
    } catch (error) {
      if (!refusalIn(error)) return;
      if (this.#seen) this.#show(null, errorText(error));
    }
  }

  #show(aim, reason = '') {
    const { parts } = this;
    setText(parts.fault, reason);
    const isWall = aim && this.#step === 'width' && this.#rig.value.pipe.diameter_mm > 0;
    parts.rings.setAttribute('d', isWall ? pathOf(aim.rings) : '');
    parts.generators.setAttribute('d', isWall ? pathOf(aim.generators) : '');
    if (aim) this.#ofRig = aim.axis;
    this.#showCross();
    setText(parts.said, aim ? this.#sentence(aim) : '');
    if (aim && this.#axis) this.#tilt(aim.pitch_deg);
  }

  /** What is certain, where the camera looks then, and what the rig said before. */
  #sentence({ pitch_deg: pitch, right_deg: right }) {
    const { axis, axis_u95_px: u95, looked_at: n, sure } = this.#seen;
    const focal = this.#rig.value.camera.fx;
    const angle = degrees((Math.atan2(u95, focal) * 180) / Math.PI);
    const found = axis ? t('wizard.found', { n, sure, angle }) : t('wizard.not_found');
    if (!this.#axis) return `${found} ${t('wizard.by_rig', { up: upOf(pitch) })}`;
    const looks = t('wizard.looks', { up: upOf(pitch), aside: asideOf(right) });
    const before = this.#before;
    const isOther = before !== null && Math.abs(pitch - before.pitch) > RIG_DIFFERS_DEG;
    return isOther ? `${found} ${looks} ${t('wizard.rig_said', { up: upOf(before.pitch) })}` : `${found} ${looks}`;
  }

  /** The same pitch again would be asked for without end. */
  #tilt(pitch) {
    if (Math.abs((this.#rig.value.mount.pitch_deg ?? 0) - pitch) >= 0.02)
      this.#rig.change({ 'mount.pitch_deg': pitch });
  }
}

const degrees = (value) => Math.abs(value).toFixed(1);
const upOf = (pitch) =>
  pitch < 0 ? t('wizard.down', { angle: degrees(pitch) }) : t('wizard.up', { angle: degrees(pitch) });
const asideOf = (right) =>
  right < 0 ? t('wizard.left', { angle: degrees(right) }) : t('wizard.right', { angle: degrees(right) });

const crossAt = ([u, v], arm) => `M${u - arm} ${v}h${2 * arm}M${u} ${v - arm}v${2 * arm}`;

/** Returns the path of lines of pixels; it is interrupted where a line has none. */
const pathOf = (lines) =>
  lines
    .map((line) =>
      line
        .map((pixel, i) => pixel && `${i && line[i - 1] ? 'L' : 'M'}${pixel.join(' ')}`)
        .filter(Boolean)
        .join(''),
    )
    .join('');

const field = (name, label, unit) => html`<div class="field">
  <label for="wizard-${name}">${label}</label>
  <span class="input-with-unit"><input class="input" id="wizard-${name}" inputmode="decimal" autocomplete="off"
    data-part="${name}" /><span class="unit">${unit}</span></span></div>`;

customElements.define('rig-wizard', RigWizard);
