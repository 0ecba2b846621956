/** The bar at the top of every page: the brand, the present page, and the person's menu. */

import { post } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { LANGUAGES, language, t, wordFor } from '../../../core/page/words.js';
import { showHelp } from '../help-dialog/help-dialog.js';
import { icon } from '../icon/icon.js';
import { closesElsewhere } from '../menu/menu.js';
import { openSettings, redrawWith } from '../settings-dialog/settings-dialog.js';

/**
 * @param {string} [here] name of the page, when it is not the list of inspections
 */
export const topBar = (here) => html`<header class="topbar row line-below">
  <a class="brand inline-row plain" href="/">${icon('logo')}Chainage</a>
  ${
    here &&
    html`<nav class="crumbs shrinks" aria-label="${t('page.breadcrumb')}"><ol>
    <li><a href="/">${t('list.title')}</a></li><li aria-current="page">${here}</li></ol></nav>`
  }
  <span class="spacer"></span>
  <person-menu></person-menu>
</header>`;

export class PersonMenu extends Component {
  mount() {
    /** @type {Parts<'top-bar/top-bar'>} */
    this.parts = render(
      this,
      html`<details class="menu holds" data-part="menu">
        <summary class="button button--quiet button--small button--icon" aria-label="${t('menu.title')}"
          title="${t('menu.title')}">${icon('menu')}</summary>
        <div class="menu__list panel">
          <div class="choices flow gap-1 pad-1" role="group" aria-label="${t('settings.language')}">
            ${LANGUAGES.map(
              ([code, name]) => html`<button class="button button--small" data-language="${code}"
              lang="${code}" aria-pressed="${String(code === language)}">${name}</button>`,
            )}
          </div>
          <button class="menu__item menu__item--line" data-part="settings">${icon('settings')}${t('menu.settings')}</button>
          ${may('admin') && html`<a class="menu__item menu__item--line" href="/users">${icon('people')}${t('menu.users')}</a>`}
          <button class="menu__item menu__item--line" data-part="help">${icon('help')}${t('menu.help')}</button>
          <button class="menu__item menu__item--line" data-part="leave">${icon('leave')}${t('menu.log_out')}</button>
          <p class="help pad-row" data-part="person"></p>
        </div>
      </details>`,
    );
    const { menu, settings, help, leave } = this.parts;
    closesElsewhere(menu, this.signal);
    for (const button of this.querySelectorAll('[data-language]')) {
      this.listen(button, 'click', () => redrawWith({ language: button.dataset.language }));
    }
    this.listen(settings, 'click', () => openSettings());
    this.listen(help, 'click', () => showHelp());
    this.listen(leave, 'click', async () => {
      await post('/api/logout');
      location.assign('/login');
    });
    this.listen(menu, 'toggle', () => this.#showPerson());
  }

  #showPerson() {
    const { person } = preferences;
    this.parts.person.hidden = !person;
    if (!person) return;
    const role = wordFor('role', person.role) ?? person.role;
    this.parts.person.textContent = t('menu.person', { name: person.name, role });
  }
}

customElements.define('person-menu', PersonMenu);
