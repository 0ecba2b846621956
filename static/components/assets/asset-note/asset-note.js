/**
 * What the register knows of the id in a field: it may exist in another spelling, which can be taken, and its
 * fields may have been filled in.
 *
 * Event `looked` (detail {assetId, fields}): the server has answered about an id; `fields` are those of the
 * register, null if it does not have the id.
 */

import { pause, refusalIn } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { alike, idsWith } from '../../../core/survey/register.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

/** Pause after a typed letter before the server is asked. */
const SETTLE_S = 0.2;
const MOST_SPELLINGS = 3;

export class AssetNote extends Component {
  #input;
  #asked = new AbortController();

  mount() {
    /** @type {Parts<'asset-note/asset-note'>} */
    this.parts = render(
      this,
      html`<div role="status" data-part="same"></div><div role="status" data-part="filled"></div>`,
    );
    this.listen(this.parts.same, 'click', ({ target }) => {
      const button = target.closest('[data-take]');
      if (button) this.#take(button.dataset.take);
    });
  }

  /**
   * Follows what is typed into a field.
   * @param {HTMLInputElement} input
   * @param {HTMLDataListElement} [offers] shows the registered ids that fit
   */
  follow(input, offers = null) {
    this.#input = input;
    this.listen(input, 'input', () => this.#look(SETTLE_S, offers));
    this.listen(input, 'change', () => this.#look(0, null));
  }

  /**
   * Says which fields were filled in; none removes the note.
   * @param {string[]} names
   * @param {() => void} undo
   */
  showFilled(names, undo) {
    const { undo: button } = render(
      this.parts.filled,
      html`${
        names.length > 0 &&
        html`<p class="message">${icon('info')}<span>${t('register.filled', { names: names.join(', ') })}</span>
        <button type="button" class="button button--small" data-part="undo">${icon('undo')}${t('page.undo')}</button></p>`
      }`,
    );
    button?.addEventListener('click', () => {
      undo();
      this.#input.focus(); // the button is gone
    });
  }

  /** Asks the server about the id after a pause; a newer question takes the place of an older one. */
  async #look(settleS, offers) {
    this.#asked.abort();
    this.#asked = new AbortController();
    const signal = AbortSignal.any([this.#asked.signal, this.signal]);
    await pause(settleS, signal);
    if (signal.aborted) return;
    const assetId = this.#input.value.trim();
    try {
      const [{ same, fields }, ids] = await Promise.all([
        assetId ? alike(assetId, signal) : { same: [], fields: null },
        offers && assetId ? idsWith(assetId, signal) : [],
      ]);
      if (offers) this.#offer(offers, ids);
      this.#showSame(fields === null ? same : []);
      this.dispatchEvent(new CustomEvent('looked', { detail: { assetId, fields } }));
    } catch (error) {
      if (!refusalIn(error)) return;
      this.#showSame([]); // a hint only: the field works without it
    }
  }

  /** The list belongs to the field only while it offers something. */
  #offer(offers, ids) {
    render(offers, html`${ids.map((id) => html`<option value="${id}"></option>`)}`);
    if (ids.length) this.#input.setAttribute('list', offers.id);
    else this.#input.removeAttribute('list');
  }

  #showSame(same) {
    const shown = same.slice(0, MOST_SPELLINGS);
    render(
      this.parts.same,
      html`${
        shown.length > 0 &&
        html`<p class="message message--warning">${icon('alert')}
        <span>${t('register.same', { n: shown.length, ids: shown.join(', ') })}</span>
        ${shown.map((id) => html`<button type="button" class="button button--small" data-take="${id}">${t('register.take', { id })}</button>`)}</p>`
      }`,
    );
  }

  #take(id) {
    this.#input.value = id;
    for (const type of ['input', 'change']) this.#input.dispatchEvent(new Event(type, { bubbles: true }));
    this.#input.focus();
  }
}

customElements.define('asset-note', AssetNote);
