/**
 * Tags by letters alone: B opens the list of what may follow, each letter narrows it, and the main code makes the tag,
 * whose form asks for the rest. 0 opens the templates instead. The tag belongs to the frame that was shown at the first letter.
 */

import { html, render } from '../../../core/page/html.js';
import { lastCodes, typedSoFar } from '../../../core/defects/code-chain.js';
import { codeOf } from '../../../core/defects/codes.js';
import { isTaken } from '../../../core/page/keys.js';
import { preferences } from '../../../core/page/preferences.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { severityMark } from '../../shared/severity-mark/severity-mark.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { TEMPLATE_KEYS, templatesMarkup } from './templates.js';

const LAST = 5;

export class CodeChain extends Component {
  #text = '';
  #typed;
  /** Whether the templates are listed instead of the letters. */
  #isListing = false;
  /** Codes of the last tags. */
  #last = [];
  #end = null;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.hidden = true;
    this.setAttribute('role', 'group');
    this.setAttribute('aria-label', t('chain.title'));
    this.listen(this, 'click', ({ target }) => {
      const { key, forget } = target.closest('[data-key], [data-forget]')?.dataset ?? {};
      if (forget) this.#forget(Number(forget));
      else if (key) this.#press(key);
    });
    this.listen(preferences, 'change', () => this.hidden || this.#show());
  }

  disconnectedCallback() {
    this.close();
    super.disconnectedCallback();
  }

  /** Begins with the frame on the screen. @param {string} letter that was pressed */
  open(letter) {
    if (!this.desk.hold()) return;
    this.desk.editing.set(false); // its questions would take the letters
    this.#last = lastCodes(this.desk.observations.value, LAST);
    this.hidden = false;
    this.#isListing = false;
    this.#end?.abort();
    this.#end = new AbortController();
    // In the 3D view the keys would go on moving its camera.
    if (document.activeElement instanceof HTMLIFrameElement) document.activeElement.blur();
    // Before the keys of the page: while a code is typed, they are its letters.
    document.addEventListener('keydown', (event) => this.#key(event), { capture: true, signal: this.#end.signal });
    this.#type('');
    // In most packs all codes begin with the same letter, which is there already.
    if (!this.#typed.letters.startsWith(letter.toUpperCase())) this.#press(letter);
  }

  close() {
    this.#end?.abort();
    this.hidden = true;
  }

  #key(event) {
    const { key } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || isTaken(event.target, key)) return;
    if (!/^([a-z0-9]|Enter|Escape|Backspace)$/i.test(key)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.#press(key);
  }

  #press(key) {
    const { row, choices } = this.#typed;
    const letter = key.toUpperCase();
    if (key === 'Escape') this.close();
    else if (key === 'Backspace') this.#back();
    else if (this.#isListing) this.#pick(letter);
    else if (key === '0') this.#list(true);
    else if (key === 'Enter' && row) this.#tag();
    else if (choices.some((choice) => choice.letter === letter)) this.#type(this.#typed.letters + letter);
    else if (this.#last[Number(key) - 1]) this.#finish(this.#last[Number(key) - 1]);
  }

  #back() {
    if (this.#isListing) {
      this.#list(false);
      return;
    }
    if (!this.#text) {
      this.close();
      return;
    }
    // Letters that followed by themselves go with the one that was typed before them.
    let text = this.#text.slice(0, -1);
    const rows = this.desk.catalogue.rows;
    while (text && typedSoFar(rows, text).letters === this.#typed.letters) text = text.slice(0, -1);
    this.#type(text);
  }

  #list(isListing) {
    this.#isListing = isListing;
    this.#show();
  }

  #pick(letter) {
    const template = preferences.value.templates[TEMPLATE_KEYS.indexOf(letter)];
    if (template) this.#finish(template);
  }

  #forget(i) {
    const keep = (at, gone, ...back) =>
      orToast(() => preferences.save({ templates: preferences.value.templates.toSpliced(at, gone, ...back) }));
    const forgotten = preferences.value.templates[i];
    keep(i, 1);
    toast(t('chain.forgotten'), { action: t('page.undo'), run: () => keep(i, 0, forgotten) });
    const rest = this.querySelectorAll('[data-forget]');
    (rest[i] ?? rest[i - 1] ?? this.querySelector('button')).focus(); // the button has gone
  }

  #type(text) {
    this.#text = text;
    this.#typed = typedSoFar(this.desk.catalogue.rows, text);
    const { letters, row } = this.#typed;
    const isSpelt =
      row && !this.desk.catalogue.rows.some((other) => other.code !== row.code && other.letters.startsWith(letters));
    if (isSpelt && text) this.#tag();
    else this.#show();
  }

  #tag() {
    this.#finish(codeOf(this.#typed.row));
  }

  #finish(fields) {
    this.close();
    this.desk.tagHeld(fields);
  }

  #show() {
    if (this.#isListing) render(this, html`${templatesMarkup(this.desk.catalogue)}${endMarkup()}`);
    else this.#showLetters();
  }

  #showLetters() {
    const { letters, row, choices } = this.#typed;
    const { catalogue } = this.desk;
    render(
      this,
      html`<p class="chain__code" role="status"><b>${letters || '…'}</b>
          ${row ? catalogue.label(row.code, row.char1 || null, row.char2 || null) : t('chain.begin')}</p>
        ${
          choices.length
            ? html`<div class="chain__keys flow gap-1">${choices.map(
                ({ letter, label }) => html`<button
          type="button" class="button button--small" data-key="${letter}"><kbd>${letter}</kbd>${label}</button>`,
              )}</div>`
            : ''
        }
        <div class="chain__keys flow gap-1" role="group" aria-label="${t('chain.last')}">${this.#last.map(
          (last, i) => html`<button
          type="button" class="button button--small" data-key="${i + 1}"><kbd>${i + 1}</kbd>${[
            last.code,
            last.char1,
            last.char2,
          ]
            .filter(Boolean)
            .join(' ')} ${severityMark(last.severity)}</button>`,
        )}
          <button type="button" class="button button--small" data-key="0"><kbd>0</kbd>${t('chain.templates')}</button>
          ${row && html`<button type="button" class="button button--small button--primary" data-key="Enter"><kbd>↵</kbd>${row.code}</button>`}</div>
        ${endMarkup()}`,
    );
  }
}

const endMarkup =
  () => html`<div class="chain__keys flow gap-1"><button type="button" class="button button--quiet button--small" data-key="Backspace"><kbd>⌫</kbd>${t('chain.back')}</button>
          <button type="button" class="button button--quiet button--small" data-key="Escape"><kbd>Esc</kbd>${t('page.cancel')}</button></div>`;

customElements.define('code-chain', CodeChain);
