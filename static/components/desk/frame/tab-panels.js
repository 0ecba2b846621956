/**
 * Panels of which one is visible, with a tab for each (ARIA tabs pattern: arrows, Home and End move). A
 * panel is created when it is first shown and then kept.
 */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';

export class TabPanels extends Component {
  #tabs;
  #shown;
  #panels = new Map();

  /**
   * @param {{name: string, title: string, element: string}[]} tabs element: the custom one that is the panel
   * @param {string} label their subject, for screen readers
   * @param {import('../../../core/page/store.js').Store} shown name of the visible tab; set it to show another
   */
  fill(tabs, label, shown) {
    this.#tabs = tabs;
    this.#shown = shown;
    /** @type {Parts<'frame/tab-panels'>} */
    this.parts = render(
      this,
      html`<div class="tabs__list line-below holds" role="tablist" aria-label="${label}" data-part="list">
          ${tabs.map(
            ({ name, title }) => html`<button class="tabs__tab inline-row holds dim nowrap" role="tab" id="tab-${name}"
            aria-controls="tab-${name}-panel" data-tab="${name}">${title}<span class="tabs__note dim number unless-empty"
            data-part="${name}Note"></span></button>`,
          )}
        </div>
        ${tabs.map(
          ({ name }) => html`<div class="tabs__panel column grow" role="tabpanel" id="tab-${name}-panel"
          aria-labelledby="tab-${name}" data-part="${name}Panel" hidden></div>`,
        )}`,
    );
    this.listen(this.parts.list, 'click', ({ target }) => {
      const tab = target.closest('[data-tab]');
      if (tab) shown.set(tab.dataset.tab);
    });
    // A click leaves the keyboard focus with the film.
    this.listen(this.parts.list, 'mousedown', (event) => event.preventDefault());
    this.listen(this.parts.list, 'keydown', (event) => this.#key(event));
    this.listen(shown, 'change', () => this.#show());
    this.#show();
  }

  /** Writes a count or a sign beside the title of a tab; '' removes it. */
  note(name, text) {
    this.parts[`${name}Note`].textContent = text;
  }

  #show() {
    for (const { name, element } of this.#tabs) {
      const isShown = name === this.#shown.value;
      const tab = this.querySelector(`[data-tab="${name}"]`);
      tab.setAttribute('aria-selected', String(isShown));
      tab.tabIndex = isShown ? 0 : -1;
      if (isShown) this.#scrollTo(tab);
      const panel = this.parts[`${name}Panel`];
      panel.hidden = !isShown;
      if (isShown && !this.#panels.has(name)) {
        this.#panels.set(name, Object.assign(document.createElement(element), { className: 'grow scrolls' }));
        panel.append(this.#panels.get(name));
      }
    }
  }

  /** Scrolls the row of tabs alone: the page must stay where it is. */
  #scrollTo({ offsetLeft: left, offsetWidth: width }) {
    const { list } = this.parts;
    list.scrollLeft = Math.min(Math.max(list.scrollLeft, left + width - list.clientWidth), left);
  }

  #key(event) {
    const names = this.#tabs.map(({ name }) => name);
    const here = names.indexOf(this.#shown.value);
    const goal = {
      ArrowRight: (here + 1) % names.length,
      ArrowLeft: (here + names.length - 1) % names.length,
      Home: 0,
      End: names.length - 1,
    }[event.key];
    if (goal === undefined || event.shiftKey) return;
    event.preventDefault();
    this.#shown.set(names[goal]);
    this.querySelector(`[data-tab="${names[goal]}"]`).focus();
  }
}

customElements.define('tab-panels', TabPanels);
