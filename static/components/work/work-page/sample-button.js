/** The way to the sample, which the server renders once and then keeps. */

import { get, pause, post } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast, toastError } from '../../shared/toast-stack/toast-stack.js';

const POLL_S = 0.5;

export class SampleButton extends Component {
  mount() {
    /** @type {Parts<'work-page/sample-button'>} */
    this.parts = render(
      this,
      html`<button class="button" data-part="sample">${icon('film')}<span data-part="word">${t('list.sample')}</span></button>`,
    );
    this.listen(this.parts.sample, 'click', () => this.#make());
  }

  async #make() {
    const { sample, word } = this.parts;
    sample.disabled = true;
    await orToast(async () => {
      let made = await post('/api/samples');
      while (made.state === 'rendering' && !this.signal.aborted) {
        word.textContent = t('list.sample_making', { percent: Math.floor(100 * made.progress) });
        await pause(POLL_S, this.signal);
        made = await get('/api/samples', this.signal);
      }
      if (made.error) toastError(made.error);
      else location.assign(`/inspections/${made.inspection_id}`);
    });
    sample.disabled = false;
    word.textContent = t('list.sample');
  }
}

customElements.define('sample-button', SampleButton);
