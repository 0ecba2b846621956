/** The bar at the top of every page: the brand, the sections, and the person's menu. */

import { post } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { Component } from '../../../core/page/store.js';
import { LANGUAGES, language, t, wordFor } from '../../../core/page/words.js';
import { showHelp } from '../help-dialog/help-dialog.js';
import { icon } from '../icon/icon.js';
import { closesElsewhere } from '../menu/menu.js';
import { redrawWith } from '../../settings/settings-page/redraw.js';
import { SECTIONS, sectionOf } from './sections.js';

export const topBar = () => {
  const here = sectionOf(location.pathname);
  return html`<header class="topbar row line-below">
  <a class="brand inline-row plain" href="/">${icon('logo')}Chainage</a>
  <nav class="main-nav" aria-label="${t('nav.label')}"><ul class="row gap-1">${SECTIONS.map(
    (section) =>
      html`<li><a class="tab-link" href="${section.path}" ${section === here && html`aria-current="${section.path === location.pathname ? 'page' : 'true'}"`}>${icon(section.sign)}${section.name}</a></li>`,
  )}</ul></nav>
  <span class="spacer"></span>
  <person-menu></person-menu>
</header>`;
};

/** The way between the pages of the present section; nothing where it has one only. */
export const partsBar = () => {
  const { name, parts = [] } = sectionOf(location.pathname);
  return html`${
    parts.length > 0 &&
    html`<nav class="section-parts line-below" aria-label="${name}"><ul class="row gap-1">${parts.map(
      ([path, title]) =>
        html`<li><a class="tab-link" href="${path}" ${path === location.pathname && html`aria-current="page"`}>${title}</a></li>`,
    )}</ul></nav>`
  }`;
};

export class PersonMenu extends Component {
  mount() {
    // The desk has its own bar, without the sections.
    const isOnDesk = this.closest('desk-bar') !== null;
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
          ${isOnDesk && SECTIONS.map(({ path, name, sign }) => html`<a class="menu__item" href="${path}">${icon(sign)}${name}</a>`)}
          <button class="menu__item menu__item--line" data-part="help">${icon('help')}${t('menu.help')}</button>
          <button class="menu__item menu__item--line" data-part="leave">${icon('leave')}${t('menu.log_out')}</button>
          <p class="help pad-row" data-part="person"></p>
        </div>
      </details>`,
    );
    const { menu, help, leave } = this.parts;
    closesElsewhere(menu, this.signal);
    for (const button of this.querySelectorAll('[data-language]')) {
      this.listen(button, 'click', () => redrawWith({ language: button.dataset.language }));
    }
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
