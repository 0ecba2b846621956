/**
 * The third picture of the wizard: "Is there a counter?". It is searched in the film, drawn, and may be drawn
 * elsewhere or denied. Fires `answer` with what is stated about it, null for what the search finds, and `shown`
 * with what else is burnt into the film: {date}.
 *
 * Set `film` to {address, width, height, pixel_aspect}; `open` starts the search.
 */

import { get, refusalIn } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t } from '../../../core/page/words.js';
import '../../distance/corrections/counter-box.js';
import { icon } from '../../shared/icon/icon.js';

const UNITS = ['m', 'ft'];

export class CounterStep extends Component {
  /** @type {{address: string, width: number, height: number, pixel_aspect: number}} */
  film;

  /** The box that was found; null if there is none, or while it is searched. */
  #found = null;
  /** The box that a person drew, and the unit that a person stated, if the film shows none. */
  #drawn = null;
  #unit = null;
  #isOpen = false;

  mount() {
    /** @type {Parts<'rig-wizard/counter-step'>} */
    this.parts = render(
      this,
      html`<counter-box data-part="picture"></counter-box>
        <p class="number" role="status" data-part="said"></p>
        <div class="row wrap" data-part="units" hidden><span>${t('notice.counter_unit')}</span>${UNITS.map(
          (unit) =>
            html`<button type="button" class="button button--small" data-unit="${unit}" aria-pressed="false">${unit}</button>`,
        )}</div>
        <div class="flow">
          <button type="button" class="button button--small" data-part="again" hidden>${icon('retry')}${t('wizard.counter_back')}</button>
          <button type="button" class="button button--small" data-part="none" aria-pressed="false">${icon('close')}${t('counter.none')}</button>
        </div>`,
    );
    const { picture, again, none, units } = this.parts;
    this.listen(picture, 'box', () => {
      this.#drawn = picture.value;
      this.#answer(this.#present, t('wizard.counter_drawn'));
    });
    this.listen(again, 'click', () => {
      picture.value = this.#found;
      this.#drawn = null;
      this.#answer(this.#unit ? this.#present : null, t('wizard.counter_found'));
    });
    this.listen(units, 'click', ({ target }) => {
      const { unit } = target.closest('button')?.dataset ?? {};
      if (!unit) return;
      this.#unit = unit;
      for (const button of units.querySelectorAll('button'))
        button.setAttribute('aria-pressed', String(button.dataset.unit === unit));
      this.#answer(this.#present, this.parts.said.textContent);
    });
    this.listen(none, 'click', () => {
      picture.value = null;
      this.#answer({ is_present: false }, t('wizard.counter_none'));
    });
  }

  get #present() {
    return { is_present: true, box: this.#drawn, unit: this.#unit };
  }

  async open() {
    if (this.#isOpen) return;
    this.#isOpen = true;
    const { address, ...film } = this.film;
    const { picture, said } = this.parts;
    picture.draw({ source: `${address}/picture`, alt: t('wizard.picture'), ...film }, null);
    said.textContent = t('counter.searching');
    try {
      const { box, unit, film_date: date } = await get(`${address}/counter`, this.signal);
      this.dispatchEvent(new CustomEvent('shown', { detail: { date }, bubbles: true }));
      this.#found = box;
      this.parts.units.hidden = !box || unit !== '';
      const isAnswered = said.textContent !== t('counter.searching');
      if (isAnswered) this.parts.again.hidden = box === null;
      else {
        picture.value = box;
        said.textContent = box ? t('wizard.counter_found') : t('wizard.counter_not_found');
      }
    } catch (error) {
      if (!refusalIn(error)) return;
      said.textContent = errorText(error);
    }
  }

  #answer(stated, text) {
    setText(this.parts.said, text);
    this.parts.again.hidden = (stated?.is_present !== false && !this.#drawn) || this.#found === null;
    this.parts.none.setAttribute('aria-pressed', String(stated?.is_present === false));
    this.dispatchEvent(new CustomEvent('answer', { detail: stated }));
  }
}

customElements.define('counter-step', CounterStep);
