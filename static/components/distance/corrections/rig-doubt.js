/** Tolerances of the rig: the scale of a track is the camera height over the focal length. */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { isNotNegative, isPositive, numberField, read, write } from './fields.js';

export class RigDoubt extends Component {
  mount() {
    const { corrections } = this.closest('inspection-page').desk;
    this.corrections = corrections;
    this.parts = render(
      this,
      html`<h3>${t('corrections.rig')}</h3>
        <p class="help">${t('corrections.rig_help')}</p>
        <div class="fix__row stack gap-3 halves">
          ${numberField({ part: 'height', id: 'rig-height', label: t('corrections.rig_height'), unit: 'mm' })}
          ${numberField({ part: 'focal', id: 'rig-focal', label: t('corrections.rig_focal'), unit: 'px' })}
        </div>`,
    );
    this.listen([this.parts.height, this.parts.focal], 'change', () => this.#typed());
    this.listen(corrections.draft, 'change', () => this.#show());
    this.#show();
  }

  /** Without a height nothing is stated: the focal length alone is not enough. */
  #typed() {
    const height = read(this.parts, 'height', isPositive, t('corrections.fault_positive'));
    const focal = read(this.parts, 'focal', isNotNegative, t('corrections.fault_not_negative'));
    if (height === undefined || focal === undefined) return;
    this.corrections.edit({
      rig_sigma: height === null ? null : { height_mm: height, focal_px: focal ?? 0 },
    });
  }

  #show() {
    const { rig_sigma: sigma } = this.corrections.draft.value;
    write(this.parts.height, sigma?.height_mm ?? null);
    if (sigma) write(this.parts.focal, sigma.focal_px);
  }
}

customElements.define('rig-doubt', RigDoubt);
