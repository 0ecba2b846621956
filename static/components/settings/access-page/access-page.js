/** The tokens of people and programs, for administrators: make, change the role, revoke, last seen. */

import { get, put, remove } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { ROLES, may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { date } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { framedPage } from '../../shared/page-frame/page-frame.js';
import { askRevoke, makeToken } from './dialogs.js';

export class AccessPage extends Component {
  #tokens = [];

  mount() {
    /** @type {Parts<'access-page/access-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('users.title'),
        ways:
          may('admin') &&
          html`<button class="button button--primary" data-part="add">${icon('plus')}${t('users.add')}</button>`,
        content: may('admin')
          ? html`<p class="dim users__intro">${t('users.intro')}</p><div data-part="list"></div>`
          : html`<p class="message">${icon('info')}<span>${t('users.admin')}</span></p>`,
      }),
    );
    if (!may('admin')) return;
    const { add, list } = this.parts;
    this.listen(add, 'click', () => orToast(async () => (await makeToken()) && this.#load()));
    this.listen(list, 'change', ({ target }) =>
      orToast(() => this.#changeRole(this.#tokens[target.dataset.role], target.value)),
    );
    this.listen(list, 'click', ({ target }) => {
      const button = target.closest('[data-revoke]');
      if (button) orToast(() => this.#revoke(this.#tokens[button.dataset.revoke]));
    });
    this.listen(preferences, 'change', () => this.#show()); // who 'you' is
    orToast(() => this.#load());
  }

  async #load() {
    const { tokens } = await get('/api/tokens', this.signal);
    this.#tokens = tokens;
    this.#show();
  }

  async #changeRole({ name }, role) {
    try {
      await put(`${pathOf(name)}/role`, { role });
      toast(t('users.role_changed', { name, role: wordFor('role', role) }));
    } finally {
      await this.#load(); // a refused choice goes back to what holds
    }
  }

  async #revoke({ name }) {
    if (!(await askRevoke(name))) return;
    await remove(pathOf(name));
    await this.#load();
    this.parts.add.focus();
    toast(t('users.revoked', { name }));
  }

  #show() {
    const indexed = this.#tokens.map((token, index) => ({ ...token, index }));
    const revoked = indexed.filter(({ revoked_at: at }) => at !== null);
    render(
      this.parts.list,
      html`<div class="users panel holds"><table>
          <thead><tr><th scope="col">${t('users.name')}</th><th scope="col">${t('users.role')}</th><th scope="col">${t('users.seen')}</th>
            <th scope="col">${t('users.sessions')}</th><th scope="col">${t('users.created')}</th><th><span class="visually-hidden">${t('users.revoke')}</span></th></tr></thead>
          <tbody>${indexed.filter(({ revoked_at: at }) => at === null).map(rowMarkup)}</tbody></table></div>
        ${
          revoked.length > 0 &&
          html`<details class="users__revoked"><summary>${t('users.revoked_tokens', { n: revoked.length })}</summary>
          <ul>${revoked.map(({ name, role, revoked_at: at }) => html`<li><b>${name}</b> <span class="dim">${wordFor('role', role)} · ${t('users.revoked_on', { when: date(at) })}</span></li>`)}</ul></details>`
        }`,
    );
  }
}

const pathOf = (name) => `/api/tokens/${encodeURIComponent(name)}`;

function rowMarkup({ name, role, projects, seen_at: seen, sessions, created_at: created, is_server: isServer, index }) {
  const isYou = name === preferences.person?.name;
  return html`<tr><th scope="row">${name} ${isYou && html`<span class="chip">${t('users.you')}</span>`}
      ${isServer && html`<span class="dim users__note">${t('users.server')}</span>`}
      ${projects && html`<span class="dim users__note">${t('users.only', { projects: projects.join(', ') })}</span>`}</th>
    <td>${
      isServer
        ? wordFor('role', role)
        : html`<select class="input" aria-label="${t('users.role_of', { name })}" data-role="${index}">
          ${ROLES.map((each) => html`<option value="${each}" ${each === role && 'selected'}>${wordFor('role', each)}</option>`)}</select>`
    }</td>
    <td class="number">${seen ? date(seen) : html`<span class="dim">${t('users.never')}</span>`}</td>
    <td class="number">${sessions > 0 ? t('users.browsers', { n: sessions }) : html`<span class="dim">–</span>`}</td>
    <td class="number">${created ? date(created) : html`<span class="dim">–</span>`}</td>
    <td>${!isServer && html`<button class="button button--small" data-revoke="${index}" aria-label="${t('users.revoke_named', { name })}">${t('users.revoke')}</button>`}</td></tr>`;
}

customElements.define('access-page', AccessPage);
