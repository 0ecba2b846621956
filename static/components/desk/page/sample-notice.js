/** What to do next with the sample: tag the crack, give it a code, look at the report. */

import { get, refusalIn } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

/** Who made the tags that the sample begins with. */
const MAKER = 'chainage';

export class SampleNotice extends Component {
  mount() {
    const { desk } = this.closest('inspection-page');
    this.classList.add('message');
    this.setAttribute('role', 'status');
    /** @type {Parts<'page/sample-notice'>} */
    this.parts = render(this, html`${icon('info')}<span data-part="text"></span>`);
    this.listen(desk.observations, 'change', () => this.#show(desk.observations.value));
    this.#show(desk.observations.value);
    this.#find(desk.inspection.value.id);
  }

  /** Stays hidden at every other inspection. */
  async #find(id) {
    try {
      const { inspection_id: sample } = await get('/api/samples', this.signal);
      this.hidden = sample !== id;
    } catch (error) {
      if (!refusalIn(error)) return; // a hint only
    }
  }

  #show(observations) {
    const own = observations.filter(({ created_by: who }) => who !== MAKER);
    const next = own.some(({ code }) => code) ? t('sample.export') : own.length ? t('sample.code') : t('sample.click');
    setText(this.parts.text, next);
  }
}

customElements.define('sample-notice', SampleNotice);
