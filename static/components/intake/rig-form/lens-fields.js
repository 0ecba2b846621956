/**
 * What people know of a lens: its angle of view, or sensor and focal length in mm; px are for experts.
 *
 * `camera` is the camera of the rig, from which the angle is shown. Event `lens`: somebody has typed; its detail
 * are the changed fields of the rig. Event `mode`: the lens is given in another way.
 */

import { html, render } from '../../../core/page/html.js';
import { angleOfFocal, focalDown, focalOfAngle, focalOfSensor } from '../../../core/wall/lens.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';

const MODES = [
  ['angle', t('lens.by_angle')],
  ['sensor', t('lens.by_sensor')],
  ['px', t('lens.by_px')],
];

export class LensFields extends Component {
  #camera = /** @type {import('../../../core/wall/lens.js').Size & {model?: string, fx?: number}} */ ({});

  mount() {
    /** @type {Parts<'rig-form/lens-fields'>} */
    this.parts = render(
      this,
      html`<div class="rig__grid fields gap-4">
        <div class="field"><label for="lens-mode">${t('lens.mode')}</label>
          <select class="input" id="lens-mode" data-part="mode">
            ${MODES.map(([mode, text]) => html`<option value="${mode}">${text}</option>`)}</select></div>
        <div class="field" data-of="angle"><label for="lens-angle">${t('lens.angle')}</label>
          ${number('angle', '°')}<span class="help">${t('lens.angle_help')}</span></div>
        <div class="field" data-of="angle"><label for="lens-across">${t('lens.across')}</label>
          <select class="input" id="lens-across" data-part="across">
            <option value="horizontal">${t('lens.horizontal')}</option>
            <option value="diagonal">${t('lens.diagonal')}</option></select></div>
        <div class="field" data-of="sensor"><label for="lens-sensor">${t('lens.sensor')}</label>
          ${number('sensor', 'mm')}<span class="help">${t('lens.sensor_help')}</span></div>
        <div class="field" data-of="sensor"><label for="lens-focal">${t('lens.focal')}</label>
          ${number('focal', 'mm')}<span class="help">${t('lens.focal_help')}</span></div>
      </div>
      <span class="fault" id="lens-fault" data-part="fault"></span>`,
    );
    this.listen(this.parts.mode, 'change', () => {
      this.#showMode();
      this.dispatchEvent(new Event('mode'));
    });
    for (const name of ['angle', 'sensor', 'focal']) this.listen(this.parts[name], 'input', () => this.#typed());
    this.listen(this.parts.across, 'change', () => this.#typed());
    this.#showMode();
  }

  get mode() {
    return this.parts.mode.value;
  }

  set mode(mode) {
    this.parts.mode.value = mode;
    this.#showMode();
  }

  set fault(text) {
    this.parts.fault.textContent = text;
    for (const name of ['angle', 'sensor', 'focal']) this.parts[name].setAttribute('aria-invalid', String(text !== ''));
  }

  set camera(camera) {
    const isOther = ['width', 'height', 'model', 'pixel_aspect'].some((name) => camera[name] !== this.#camera[name]);
    this.#camera = camera;
    if (isOther && this.mode !== 'px' && this.#isGiven) this.#typed();
    else this.#showAngle();
  }

  /** Focuses the first field of the present way. */
  focus() {
    (this.mode === 'sensor' ? this.parts.sensor : this.parts.angle).focus();
  }

  get #isGiven() {
    const { angle, sensor, focal } = this.parts;
    return (this.mode === 'angle' ? [angle] : [sensor, focal]).every(({ value }) => value.trim() !== '');
  }

  #showMode() {
    for (const field of this.querySelectorAll('[data-of]')) field.hidden = field.dataset.of !== this.mode;
    this.#showAngle();
  }

  /** What is being typed stays as it is. */
  #showAngle() {
    const { angle, across } = this.parts;
    if (this.mode !== 'angle' || angle === document.activeElement) return;
    const shown = angleOfFocal(this.#camera.fx, across.value, this.#camera);
    if (Number.isFinite(shown)) angle.value = Number(shown.toFixed(1));
  }

  /** A lens that is known by its angle has neither distortion nor a measured centre. */
  #typed() {
    const { angle, across, sensor, focal } = this.parts;
    const typed = ({ value }) => Number(value.trim().replace(',', '.'));
    const camera = this.#camera;
    const px =
      this.mode === 'angle'
        ? focalOfAngle(typed(angle), across.value, camera)
        : focalOfSensor(typed(focal), typed(sensor), camera);
    const rounded = px > 0 && Number.isFinite(px) ? Number(px.toFixed(2)) : '';
    const middle = (pixels) => (pixels > 0 ? (pixels - 1) / 2 : '');
    const detail = {
      'camera.fx': rounded,
      'camera.fy': rounded && focalDown(rounded, camera.pixel_aspect),
      'camera.cx': middle(camera.width),
      'camera.cy': middle(camera.height),
      'camera.distortion': '',
      'camera.skew': '',
    };
    this.dispatchEvent(new CustomEvent('lens', { detail }));
  }
}

const number = (name, unit) => html`<span class="input-with-unit"><input class="input" id="lens-${name}"
  inputmode="decimal" autocomplete="off" aria-describedby="lens-fault" data-part="${name}" />
  <span class="unit">${unit}</span></span>`;

customElements.define('lens-fields', LensFields);
