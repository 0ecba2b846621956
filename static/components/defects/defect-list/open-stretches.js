/** Stretches that were started and not finished: always visible, and finished from here. */

import { html, patchList, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { openStretches } from '../../../core/defects/stretches.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { finishStretch } from '../../desk/actions/stretches.js';

export class OpenStretches extends Component {
  #open = [];

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'defect-list/open-stretches'>} */
    this.parts = render(this, html`<ul data-part="rows" aria-label="${t('stretch.open')}"></ul>`);
    this.listen(this.desk.observations, 'change', () => this.#update());
    this.listen(this.desk.playhead, 'change', () => this.#open.length && this.repaint());
    // A click leaves the keyboard focus with the film.
    this.listen(this, 'mousedown', (event) => event.preventDefault());
    this.#update();
  }

  #update() {
    this.#open = openStretches(this.desk.observations.value);
    this.hidden = this.#open.length === 0;
    patchList(
      this.parts.rows,
      this.#open,
      ({ number }) => number,
      (stretch) => this.#createRow(stretch),
      (row, stretch) => this.#updateRow(row, stretch),
    );
    this.#showKey();
    this.paint();
  }

  #createRow({ number }) {
    const row = Object.assign(document.createElement('li'), { className: 'open-stretch row', startId: '' });
    row.parts = render(
      row,
      html`<button class="open-stretch__start row bare grow shrinks" data-part="start">${icon('stretch')}<b data-part="name"></b>
          <span class="open-stretch__from one-line grow shrinks dim number" data-part="from"></span>
          <b class="number" data-part="length"></b></button>
        <button class="button button--small" data-part="finish" data-needs="operator">${t('stretch.finish_short')}<kbd data-part="key"></kbd></button>`,
    );
    row.parts.start.addEventListener('click', () => this.desk.goTo(row.startId));
    row.parts.finish.addEventListener('click', () => finishStretch(this.desk, Number(number)));
    return row;
  }

  #updateRow(row, { number, start }) {
    const name = [`A${number}`, start.code].filter(Boolean).join(' ');
    row.startId = start.id;
    row.parts.name.textContent = name;
    row.parts.from.textContent = t('stretch.from', { where: chainage(start.distance_m) });
    row.parts.start.title = t('stretch.show_start');
    row.parts.finish.setAttribute('aria-label', t('stretch.finish_named', { name }));
    row.parts.finish.title = t('stretch.finish');
  }

  /** Shows the key on the button of the newest stretch, which it finishes. */
  #showKey() {
    [...this.parts.rows.children].forEach((row, i) => {
      row.parts.key.textContent = i === 0 ? 'F' : '';
      row.parts.key.hidden = i > 0;
    });
  }

  /** Shows the length of each so far. */
  paint() {
    const { hereM } = this.desk;
    [...this.parts.rows.children].forEach((row, i) => {
      const length = hereM === null ? 0 : hereM - this.#open[i].start.distance_m;
      row.parts.length.textContent = length > 0 ? t('stretch.so_far', { length: chainage(length) }) : '';
    });
  }
}

customElements.define('open-stretches', OpenStretches);
