/** The distance of the shown frame in very large digits, its interval, and whether to trust it. */

import { html, render } from '../../core/html.js';
import { Component } from '../../core/store.js';
import { metresNumber, plusMinus, u95FromSigma } from '../../core/units.js';
import { icon } from '../icon/icon.js';

const HEALTH = {
  ok: ['check', 'Locked on the wall'],
  weak: ['alert', 'Weak: low confidence'],
  lost: ['alert', 'Lost: bridging the gap'],
  none: ['wait', 'No distance yet'],
};

class DistanceReadout extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', 'Distance');
    this.parts = render(
      this,
      html`<p class="readout__distance number"><span data-part="value">–</span> <span class="readout__unit">m</span></p>
        <div class="readout__trust">
          <p class="readout__interval number"><span data-part="interval"></span> <span class="dim">(95 %)</span></p>
          <p class="readout__health" role="status" data-part="health"></p>
          <p class="dim readout__joint number" data-part="joint"></p>
        </div>`,
    );
    this.listen(this.desk.playhead, 'change', () => this.repaint());
    this.paint();
  }

  paint() {
    const { parts } = this;
    const { row } = this.desk.playhead.value;
    const status = row?.status ?? 'none';
    parts.value.textContent = row ? metresNumber(row.distance_mm / 1000) : '–';
    parts.interval.textContent = row ? plusMinus(u95FromSigma(row.sigma_distance_mm)) : '± –';
    parts.joint.textContent = row ? this.#joint(row.distance_mm) : '';
    if (this.dataset.status === status) return;
    this.dataset.status = status;
    const [sign, words] = HEALTH[status];
    render(parts.health, html`${icon(sign)}<span>${words}</span>`);
  }

  /** The nearest joint behind, which a repair crew counts in the pipe. */
  #joint(distanceMm) {
    const length = this.desk.inspection.value.rig.pipe.segment_length_mm;
    if (!length || distanceMm < 0) return '';
    const number = Math.floor(distanceMm / length);
    const past = ((distanceMm - number * length) / 1000).toFixed(2);
    return number === 0 ? 'Before joint 1' : `Joint ${number} + ${past} m`;
  }
}

customElements.define('distance-readout', DistanceReadout);
