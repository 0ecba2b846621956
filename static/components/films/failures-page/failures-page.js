/** Films that failed, grouped by their reason, and one repair for all of a group. */

import { act, change, failuresOf, takeOff } from '../../../core/survey/archive.js';
import { get, poll } from '../../../core/server/api.js';
import { html, patchList, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { count } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { askTakeOff } from '../films-page/dialogs.js';
import { framedPage, showFault } from '../../shared/page-frame/page-frame.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { askOtherRig } from './rig-choice.js';

const POLL_S = 5;

export class FailuresPage extends Component {
  #groups = [];

  mount() {
    /** @type {Parts<'failures-page/failures-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('archive.failures'),
        content: html`<p class="panel sign-ok row gap-3 pad-4" data-part="none" hidden>${icon('check')}<span>${t('failures.none')}</span></p>
          <ul class="failures stack gap-3" data-part="groups" aria-label="${t('archive.failures')}"></ul>`,
      }),
    );
    this.listen(this, 'click', ({ target }) => {
      const button = target.closest('[data-repair]');
      const group = this.#groups.find((other) => keyOf(other) === button?.closest('[data-key]').dataset.key);
      if (group) orToast(() => this.#repair(button.dataset.repair, group));
    });
    poll(
      () => this.#load(),
      this.signal,
      (error) => showFault(this.parts.fault, error),
    );
  }

  async #load() {
    const { groups } = await failuresOf(this.signal);
    showFault(this.parts.fault, null);
    this.#groups = groups;
    this.parts.none.hidden = groups.length > 0;
    patchList(this.parts.groups, groups, keyOf, createGroup, updateGroup);
    return POLL_S;
  }

  async #repair(kind, { reason, count: n }) {
    const meant = { where: { reason } };
    if (kind === 'rig') {
      const { rigs } = await get('/api/archive/rules', this.signal);
      const chosen = await askOtherRig(n, rigs);
      if (!chosen) return;
      await change(meant, chosen);
    }
    if (kind === 'off') {
      if (!(await askTakeOff(n))) return;
      const taken = await takeOff(meant);
      toast(t('archive.done_take_off', { n: taken, count: count(taken) }));
    } else {
      const tried = await act('retry', meant);
      toast(wordFor('archive_done', 'retry', { n: tried, count: count(tried) }), {
        action: t('failures.watch'),
        run: () => location.assign('/films'),
      });
    }
    await this.#load();
    this.querySelector('#main').focus();
  }
}

const keyOf = ({ code, reason }) => `${code} ${reason}`;

function createGroup({ code, reason, repair, example }) {
  const item = document.createElement('li');
  item.className = 'panel failure stack gap-3 pad-4';
  const primary = (kind) => (kind === (repair === 'film' ? 'retry' : repair) ? 'button--primary' : '');
  item.parts = render(
    item,
    html`<div class="stack gap-1 shrinks breaks"><h2 class="row sign-lost">${icon('alert')}<span class="number" data-part="count"></span></h2>
        <p class="strong">${errorText({ code, detail: reason })}</p>
        <p class="dim">${t('failures.example')} <b>${example.name}</b>: ${example.detail}</p>
        <p class="help">${wordFor('repair', repair ?? 'unknown')}</p></div>
      <div class="flow">
        <span data-needs="operator"><button class="button ${primary('rig')}" data-repair="rig">${icon('settings')}${t('failures.rig')}</button></span>
        <span data-needs="operator"><button class="button ${primary('retry')}" data-repair="retry">${icon('retry')}${t('failures.retry')}</button></span>
        <a class="button" href="/films?${new URLSearchParams({ reason })}">${icon('film')}${t('failures.films')}</a>
        <span data-needs="operator"><button class="button" data-repair="off">${icon('trash')}${t('archive.take_off')}</button></span>
      </div>`,
  );
  return item;
}

/** @param {HTMLElement} element @param {Api['GroupOut']} group */
function updateGroup({ parts }, { count: n }) {
  parts.count.textContent = t('failures.count', { n, count: count(n) });
}

customElements.define('failures-page', FailuresPage);
