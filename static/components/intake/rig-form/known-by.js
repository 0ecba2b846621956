/**
 * How well a rig is known, as a choice; the figures follow and stay editable.
 *
 * Event `known`: its detail are the changed fields of the rig.
 */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';

/**
 * One sigma each. A tape and a data sheet are what the server assumes of empty fields. A calibration with a board
 * knows the lens to a fifth of a percent, and a stand the height and tilt of the camera. Of a guess, a hand's
 * width and a look are the measure.
 */
const WAYS = {
  tape: { height_mm: '', focal_percent: '', tilt_deg: '' },
  calibrated: { height_mm: 0.5, focal_percent: 0.2, tilt_deg: 0.3 },
  guessed: { height_mm: 10, focal_percent: 5, tilt_deg: 3 },
};
const OWN = 'own';
const NAMES = [
  ['tape', t('known.tape')],
  ['calibrated', t('known.calibrated')],
  ['guessed', t('known.guessed')],
  [OWN, t('known.own')],
];

export class KnownBy extends Component {
  mount() {
    /** @type {Parts<'rig-form/known-by'>} */
    this.parts = render(
      this,
      html`<div class="field"><label for="rig-known-by">${t('known.label')}</label>
        <select class="input" id="rig-known-by" aria-describedby="rig-known-by-help" data-part="way">
          ${NAMES.map(([way, text]) => html`<option value="${way}">${text}</option>`)}
        </select><span class="help" id="rig-known-by-help">${t('known.help')}</span></div>`,
    );
    const { way } = this.parts;
    this.listen(way, 'change', () => {
      const values = Object.entries(WAYS[way.value] ?? {});
      const detail = Object.fromEntries(values.map(([name, value]) => [`tolerance.${name}`, value]));
      this.dispatchEvent(new CustomEvent('known', { detail }));
    });
  }

  /** The tolerances of the rig, by which the choice is found again. */
  set tolerance(tolerance) {
    const isWay = (values) => Object.entries(values).every(([name, value]) => (tolerance[name] ?? '') === value);
    this.parts.way.value = Object.keys(WAYS).find((way) => isWay(WAYS[way])) ?? OWN;
  }
}

customElements.define('known-by', KnownBy);
