/**
 * How far the comparison of two walls is, in words, with the way to start and to cancel it; once it is done, both walls
 * in register.
 */

import { get, poll, post, refusalIn, remove } from '../../../core/server/api.js';
import { html, render, renderNew } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { WallMap } from '../../../core/wall/wall-map.js';
import { chainage } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { differencesMarkup } from './wall-differences.js';
import './wall-register.js';

const POLL_S = 1.5;

/** Events: `aligned` (detail: {map, matched}) once the walls are compared. */
export class WallComparison extends Component {
  #earlier = null;
  #path = '';

  mount() {
    this.classList.add('panel');
    this.listen(this, 'click', ({ target }) => {
      const { start, cancel } = target.closest('[data-start], [data-cancel]')?.dataset ?? {};
      if (start !== undefined) orToast(() => this.#ask(() => post(this.#path)));
      if (cancel !== undefined) orToast(() => this.#ask(() => remove(this.#path)));
    });
  }

  /**
   * @param {import('./run.js').Run} earlier
   * @param {import('./run.js').Run} later
   */
  show(earlier, later) {
    this.#earlier = earlier;
    this.later = later;
    this.#path = `${later.path}/changes/${earlier.id}`;
    return this.#follow();
  }

  async #ask(send) {
    await send();
    await this.#follow();
  }

  #follow() {
    return poll(
      async () => {
        const changes = await get(this.#path, this.signal);
        await this.#take(changes);
        return ['waiting', 'working'].includes(changes.state) ? POLL_S : null;
      },
      this.signal,
      (error) => refusalIn(error) && renderNew(this, message('error', errorText(error))),
    );
  }

  /** @param {Api['ChangesOut']} changes */
  async #take(changes) {
    const isThere = changes.state === 'done' && changes.map.length > 0;
    renderNew(
      this,
      isThere
        ? shownMarkup(changes)
        : html`<div class="row wrap pad-3" role="status">${this.#stateMarkup(changes)}</div>`,
    );
    if (!isThere) return;
    const map = new WallMap(changes);
    await this.querySelector('wall-register').show(this.#earlier, this.later, map);
    const list = await differencesMarkup(changes.differences, this.#earlier, this.later, this.signal);
    render(this.querySelector('[data-part=differences]'), list);
    this.dispatchEvent(new CustomEvent('aligned', { detail: { map, matched: changes.matched } }));
  }

  #stateMarkup({ state, share, code, detail }) {
    const button = (name, sign, text) =>
      may('operator') &&
      html`<button type="button" class="button button--small" data-${name}>${icon(sign)}${text}</button>`;
    const start = button('start', 'layers', t('walls.start'));
    if (state === 'none') return html`<p class="grow dim">${t('walls.not_compared')}</p>${start}`;
    if (state === 'failed')
      return html`<p class="grow fault">${wordFor('walls_failed', code ?? '') ?? detail}</p>${start}`;
    const text = share === null ? t('walls.waiting') : t('walls.working', { percent: Math.round(100 * share) });
    return html`<p class="grow">${text}</p>${button('cancel', 'stop', t('page.cancel'))}`;
  }

  /** Brings a place of the earlier run into sight. @param {number} mm */
  reveal(mm) {
    this.querySelector('wall-register')?.reveal(mm);
  }
}

/** The walls, and in words where they are not in register. @param {Api['ChangesOut']} changes */
const shownMarkup = ({ gaps }) => html`<wall-register></wall-register>
  <div data-part="differences"></div>
  ${
    gaps.length > 0 &&
    html`<details class="more pad-3"><summary>${t('walls.gaps', { n: gaps.length })}</summary>
    <ul>${gaps.map(({ from_m: from, to_m: to, reason }) => html`<li class="number">${t('walls.gap', { from: chainage(from), to: chainage(to), reason: wordFor('wall_gap', reason) ?? reason })}</li>`)}</ul></details>`
  }`;

customElements.define('wall-comparison', WallComparison);
