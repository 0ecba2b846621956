/**
 * The rig of a camera that looks along the pipe, asked on the first picture of its film: "Is this the axis?" and
 * "How wide is the pipe?". What is answered goes into the rig form at once. A third picture asks "Is there a
 * counter?"; the answer is `counter`.
 *
 * Set `rig` to that form, and `uploadId` to a film that has arrived, or null.
 */

import { get, post, refusalIn } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { focalDown } from '../../../core/wall/lens.js';
import { newest } from '../../../core/server/newest.js';
import { squareOf } from '../../../core/wall/pixels.js';
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
const STEPS_OF_WIZARD = ['axis', 'width', 'counter'];

export class RigWizard extends Component {
  #rig = null;
  #uploadId = null;
  /** Size of the picture, and the axis that was found in it; null while it is closed. */
  #first = null;
  #axis = null;
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
    this.listen(this.parts.open, 'click', () => this.#open());
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

  set uploadId(id) {
    if (id === this.#uploadId) return;
    this.#uploadId = id;
    if (id === null) this.#counter = null; // the next film may be another one
    this.#close();
  }

  #showAsk() {
    this.parts.open.disabled = this.#uploadId === null;
    this.parts.needs.hidden = this.#uploadId !== null;
  }

  #close() {
    this.#first = null;
    this.parts.fault.textContent = '';
    render(this.parts.body, html``);
    this.#showAsk();
  }

  async #open() {
    const { open, fault } = this.parts;
    const id = this.#uploadId;
    open.disabled = true;
    fault.textContent = '';
    try {
      const first = await get(`/api/uploads/${id}/axis`, this.signal);
      if (id === this.#uploadId) this.#begin(first);
    } catch (error) {
      if (!refusalIn(error)) return;
      fault.textContent = errorText(error);
    }
    this.#showAsk();
  }

  #begin(first) {
    const { changes, isLensGuessed } = changesFor(this.#rig.value, first);
    this.#first = first;
    this.#isLensGuessed = isLensGuessed;
    this.#axis = first.axis ?? [(first.width - 1) / 2, (first.height - 1) / 2];
    this.#draw();
    this.#rig.change(changes);
    this.#showStep('axis');
  }

  #draw() {
    const { width, height } = this.#first;
    const shown = squareOf(this.#first);
    this.parts.body.replaceChildren();
    const inside = render(
      this.parts.body,
      html`<div class="wizard stack gap-3 one-column pad-4" role="group" aria-label="${t('wizard.open')}">
        <ol class="wizard__steps flow">
          <li><button type="button" class="wizard__step tile row" data-part="toAxis"><b>1</b>${t('wizard.axis')}</button></li>
          <li><button type="button" class="wizard__step tile row" data-part="toWidth"><b>2</b>${t('wizard.width')}</button></li>
          <li><button type="button" class="wizard__step tile row" data-part="toCounter"><b>3</b>${t('wizard.counter')}</button></li>
        </ol>
        <counter-step class="stack gap-3 one-column" data-part="counter" hidden></counter-step>
        <div class="wizard__picture stage-of-picture" data-part="picture">
          <img src="/api/uploads/${this.#uploadId}/picture" width="${shown.width}" height="${shown.height}"
            alt="${t('wizard.picture')}" />
          <svg class="wizard__drawing covers" preserveAspectRatio="none" viewBox="-0.5 -0.5 ${width} ${height}" data-part="drawing">
            <path class="wizard__line" data-part="generators" />
            <path class="wizard__line wizard__line--ring" data-part="rings" />
            <g class="wizard__cross" data-part="cross" tabindex="0" role="slider" aria-valuemin="0"
              aria-valuemax="${width - 1}" aria-label="${t('wizard.cross')}" aria-describedby="wizard-help">
              <circle r="${width / 40}" />
              <path d="M${-width / 20} 0H${width / 20}M0 ${-width / 20}V${width / 20}" />
            </g>
          </svg>
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
    inside.counter.film = { ...this.#first, upload: this.#uploadId };
    this.listen(inside.counter, 'answer', ({ detail }) => (this.#counter = detail));
    this.listen(inside.yes, 'click', () => {
      this.#showStep('width');
      this.parts.diameter.focus();
    });
    this.listen(inside.again, 'click', () => this.#moveTo(this.#first.axis));
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
      const down = focal > 0 ? focalDown(focal, this.#first.pixel_aspect) : inside.focal.value;
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
    parts.fields.hidden = parts.next.hidden = !isWidth;
    parts.done.hidden = isAxis;
    parts.guessed.hidden = !isWidth || !this.#isLensGuessed;
    parts.yes.hidden = !isAxis;
    parts.again.hidden = !isAxis || !this.#first.axis;
    parts.counter.hidden = !isCounter;
    if (isCounter) parts.counter.open();
    this.#rigChanged();
  }

  /** @returns {[number, number]} */
  #pixelAt({ clientX, clientY }) {
    const { width, height } = this.#first;
    const box = this.parts.drawing.getBoundingClientRect();
    return [((clientX - box.left) / box.width) * width - 0.5, ((clientY - box.top) / box.height) * height - 0.5];
  }

  #key(event) {
    const step = STEPS[event.key];
    if (!step) return;
    event.preventDefault();
    const px = event.shiftKey ? LONG_STEP_PX : 1;
    this.#moveTo(this.#axis.map((at, i) => at + px * step[i]));
  }

  #moveTo([u, v]) {
    const { width, height } = this.#first;
    this.#axis = [Math.min(Math.max(u, 0), width - 1), Math.min(Math.max(v, 0), height - 1)];
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
    if (!this.#first) return;
    const { camera, mount, pipe } = this.#rig.value;
    const { parts } = this;
    const { pitch_mm: pitch, depth_mm: depth } = pipe.corrugation ?? {};
    const shown = { diameter: pipe.diameter_mm, height: mount.height_mm, focal: camera.fx, pitch, depth };
    for (const [name, value] of Object.entries(shown)) {
      if (parts[name] !== document.activeElement) parts[name].value = Number.isFinite(value) ? value : '';
    }
    this.#showCross();
    this.#aim();
  }

  #showCross() {
    const [u, v] = this.#axis;
    const { cross } = this.parts;
    cross.setAttribute('transform', `translate(${u} ${v})`);
    cross.setAttribute('aria-valuenow', Math.round(u));
    cross.setAttribute('aria-valuetext', t('wizard.cross_at', { u: Math.round(u), v: Math.round(v) }));
  }

  async #askAim() {
    if (!this.#first) return;
    const question = { rig: statedOf(this.#rig.value), axis: this.#axis };
    try {
      const aim = await post('/api/aim', question, this.signal);
      if (this.#first) this.#show(aim);
    } catch (error) {
      if (!refusalIn(error)) return;
      if (this.#first) this.#show(null, errorText(error));
    }
  }

  #show(aim, reason = '') {
    const { parts } = this;
    setText(parts.fault, reason);
    const isWall = aim && this.#step === 'width' && this.#rig.value.pipe.diameter_mm > 0;
    parts.rings.setAttribute('d', isWall ? pathOf(aim.rings) : '');
    parts.generators.setAttribute('d', isWall ? pathOf(aim.generators) : '');
    setText(parts.said, aim ? sentence(aim, this.#first.axis) : '');
    if (aim) this.#tilt(aim.pitch_deg);
  }

  /** The same pitch again would be asked for without end. */
  #tilt(pitch) {
    if (Math.abs((this.#rig.value.mount.pitch_deg ?? 0) - pitch) >= 0.02)
      this.#rig.change({ 'mount.pitch_deg': pitch });
  }
}

function sentence({ pitch_deg: pitch, right_deg: right }, found) {
  const degrees = (value) => Math.abs(value).toFixed(1);
  const up = pitch < 0 ? t('wizard.down', { angle: degrees(pitch) }) : t('wizard.up', { angle: degrees(pitch) });
  const aside = right < 0 ? t('wizard.left', { angle: degrees(right) }) : t('wizard.right', { angle: degrees(right) });
  return `${found ? '' : `${t('wizard.not_found')} `}${t('wizard.looks', { up, aside })}`;
}

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
