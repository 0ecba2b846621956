/** The wall of the last survey as a ruler: where this film is on it, offered as a correction. */

import { get, poll, post, refusalIn } from '../../../core/server/api.js';
import { html, renderNew } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { ofPerson, recall, remember } from '../../../core/page/remembered.js';
import { Component } from '../../../core/page/store.js';
import { chainage, day, plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const POLL_S = 2;

export class WallRuler extends Component {
  #path = '';
  #survey = null;
  /** @type {Api['RulerOut']|null} */
  #offer = null;

  mount() {
    this.page = this.closest('inspection-page');
    const { inspection } = this.page.desk;
    this.#path = `/api/inspections/${inspection.id}`;
    /** Where this browser keeps which offer the person has declined. */
    this.key = ofPerson(`chainage.declined-ruler.${inspection.id}`);
    this.hidden = true;
    this.listen(this, 'click', ({ target }) => {
      const { ruler } = target.closest('[data-ruler]')?.dataset ?? {};
      if (ruler === 'compare') orToast(() => this.#compare());
      if (ruler === 'accept') orToast(() => this.#accept());
      if (ruler === 'decline') this.#decline();
    });
    this.listen(inspection, 'change', () => this.#follow());
    this.#follow();
  }

  /** Asks once the film is tracked, and again while the walls are being compared. */
  #follow() {
    if (this.#offer !== null || this.page.desk.inspection.isUnfinished) return null;
    return poll(
      async () => {
        this.#offer = await get(`${this.#path}/ruler`, this.signal);
        const { earlier_id: id, state } = this.#offer;
        if (id && !this.#survey) this.#survey = await get(`/api/inspections/${id}`, this.signal);
        this.#show();
        return ['waiting', 'working'].includes(state) ? POLL_S : null;
      },
      this.signal,
      refusalIn, // without an offer the other ways of correcting are there
    );
  }

  async #compare() {
    await post(`${this.#path}/changes/${this.#offer.earlier_id}`);
    this.#offer = null;
    await this.#follow();
  }

  async #accept() {
    const { earlier_id: earlier, version } = this.#offer;
    const remark = t('ruler.remark', { date: this.#date });
    await this.page.desk.correctBy(() => post(`${this.#path}/ruler`, { earlier_id: earlier, version, remark }), remark);
    this.page.desk.done(t('corrections.applied'));
    this.#decline(); // it is done with
  }

  #decline() {
    remember(this.key, this.#offer.version);
    this.#show();
  }

  get #date() {
    const { header, name } = this.#survey;
    return header.date ? day(header.date) : name;
  }

  #show() {
    const { earlier_id: earlier, state, version, known } = this.#offer;
    const isDone = state === 'done' && (known.length === 0 || recall(this.key, '') === version);
    this.hidden = !earlier || isDone;
    if (this.hidden) return;
    renderNew(this, html`<h3>${t('ruler.title')}</h3>${this.#stateMarkup()}`);
  }

  #stateMarkup() {
    const { state, code, detail, known } = this.#offer;
    const button = (what, text, kind = '') =>
      html`<button type="button" class="button button--small ${kind}" data-ruler="${what}" ${!mayEdit() && 'disabled'}>${text}</button>`;
    const compare = html`<div class="fix__buttons row wrap">${button('compare', t('ruler.compare'))}</div>`;
    if (state === 'none') return html`<p class="help">${t('ruler.none', { date: this.#date })}</p>${compare}`;
    if (state === 'failed') return html`<p class="help">${wordFor('walls_failed', code ?? '') ?? detail}</p>${compare}`;
    if (state !== 'done') return html`<p class="help" role="status">${t('ruler.working')}</p>`;
    const [first] = known;
    const last = known[known.length - 1];
    return html`<p>${t('ruler.found', {
      date: this.#date,
      first: placeOf(first),
      last: placeOf(last),
      n: known.length,
    })}</p>
      <div class="fix__buttons row wrap">${button('accept', t('ruler.accept'), 'button--primary')}${button('decline', t('ruler.decline'))}</div>`;
  }
}

const placeOf = ({ earlier_m: m, u95_m: u95M }) => `${chainage(m)} ${plusMinus(u95M)}`;

customElements.define('wall-ruler', WallRuler);
