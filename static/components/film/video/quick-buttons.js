/** Buttons that tag the middle of the picture, as the keys T and 1 to 9 do. */

import { ownKey } from '../../../core/page/keys.js';
import { html, render } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { quickCodes } from './quick-codes.js';

export class QuickButtons extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.listen(this, 'click', ({ target }) => this.#tag(target.closest('button')));
    this.listen(preferences, 'change', () => this.#show());
    this.#show();
  }

  #show() {
    render(
      this,
      html`<button class="button quick__code small quick__code--plain"><kbd>${ownKey('T')}</kbd>${t('video.tag')}</button>
        ${quickCodes(this.desk.catalogue).map(
          ({ tag: { code }, label }, i) => html`<button class="button quick__code small"
          data-quick="${i}" title="${code}: ${label}"><kbd>${i + 1}</kbd>${label}</button>`,
        )}`,
    );
  }

  #tag(button) {
    if (!button) return;
    const { quick } = button.dataset;
    if (quick === undefined) this.desk.tagCentre();
    else this.desk.tagAs(quickCodes(this.desk.catalogue)[quick].tag);
  }
}

customElements.define('quick-buttons', QuickButtons);
