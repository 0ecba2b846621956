/** Turns the pages of a `PagedList`: which rows are shown, of how many, and the ways to the others. */

import { html, render, setText } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../icon/icon.js';
import { orToast } from '../toast-stack/toast-stack.js';

export class ListPager extends Component {
  /** @param {import('../../../core/page/paged-list.js').PagedList} list */
  fill(list) {
    /** @type {Parts<'pager/pager'>} */
    this.parts = render(
      this,
      html`<nav class="pager row gap-row wrap apart" aria-label="${t('pager.title')}">
        <p class="dim number" data-part="shown"></p>
        <div class="pager__ways flow">
          <button class="button button--small button--icon" data-part="first" aria-label="${t('pager.first')}" title="${t('pager.first')}">${icon('stepBack')}</button>
          <button class="button button--small" data-part="previous">${icon('back')}${t('pager.previous')}</button>
          <button class="button button--small" data-part="next">${t('pager.next')}${icon('forward')}</button>
          <button class="button button--small button--icon" data-part="last" aria-label="${t('pager.last')}" title="${t('pager.last')}">${icon('stepForward')}</button>
        </div>
      </nav>`,
    );
    const { first, previous, next, last } = this.parts;
    const lastPage = () => Math.max(0, Math.ceil(list.total / list.limit) - 1) * list.limit;
    for (const [button, offset] of [
      [first, () => 0],
      [previous, () => Math.max(0, list.offset - list.limit)],
      [next, () => Math.min(lastPage(), list.offset + list.limit)],
      [last, lastPage],
    ]) {
      this.listen(button, 'click', () => orToast(() => this.#turn(list, offset())));
    }
    this.listen(list, 'change', () => this.#show(list, lastPage()));
  }

  async #turn(list, offset) {
    await list.turnTo(offset);
    document.querySelector('#main').scrollIntoView();
  }

  #show({ total, offset, limit }, lastPage) {
    const { shown, first, previous, next, last } = this.parts;
    this.hidden = total <= limit;
    const to = Math.min(offset + limit, total);
    setText(shown, t('pager.shown', { from: count(offset + 1), to: count(to), all: count(total) }));
    // Not `disabled`: the focus would be lost at the last page.
    for (const [button, isEnd] of [
      [first, offset === 0],
      [previous, offset === 0],
      [next, offset >= lastPage],
      [last, offset >= lastPage],
    ]) {
      button.setAttribute('aria-disabled', String(isEnd));
    }
  }
}

customElements.define('list-pager', ListPager);
