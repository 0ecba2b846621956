/**
 * Chooses a folder of the server's machine, among those that it offers for films.
 *
 * `value` is the path of the folder that is open, '' while none is.
 */

import { get } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { recall, remember } from '../../../core/page/remembered.js';
import { Component } from '../../../core/page/store.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

/** Key of the folder that was chosen last. */
const REMEMBERED = 'chainage.archive-folder';

export class FolderPicker extends Component {
  value = '';

  mount() {
    this.listen(this, 'click', ({ target }) => {
      const button = target.closest('[data-path]');
      if (button) orToast(() => this.#open(button.dataset.path));
    });
    orToast(() => this.#begin());
  }

  /** Keeps the folder, to begin with it the next time. */
  remember() {
    remember(REMEMBERED, this.value);
  }

  /** Begins in the folder of the last time, else in the only one that is offered, else above all. */
  async #begin() {
    const { folders } = await this.#ask('');
    const last = recall(REMEMBERED, '');
    const within =
      folders.find(({ path }) => last === path || last.startsWith(`${path}/`)) ?? (folders.length === 1 && folders[0]);
    if (!within) return this.#open('');
    try {
      await this.#open(last.startsWith(within.path) ? last : within.path);
    } catch (error) {
      if (error.code !== 'no_such_film') throw error;
      await this.#open(within.path); // the one of the last time is gone
    }
  }

  #ask(path) {
    return get(`/api/archive/folders${path && `?${new URLSearchParams({ path })}`}`, this.signal);
  }

  async #open(path) {
    const hadFocus = this.contains(document.activeElement);
    const { folders, above, films } = await this.#ask(path);
    this.value = path;
    /** @type {Parts<'add-films/folder-picker'>} */
    this.parts = render(
      this,
      html`<div class="folder-picker framed--strong" role="group" aria-label="${t('add.folder')}">
        <p class="row wrap pad-row line-below"><b class="breaks grow" tabindex="-1" data-part="here">${path || t('add.folders')}</b>
          ${path && html`<span class="dim number">${t('add.films_here', { n: films, count: count(films) })}</span>`}</p>
        <ul class="folder-picker__list">
          ${path && html`<li><button type="button" class="folder-picker__folder row" data-path="${above ?? ''}">${icon('back')}${t('add.above')}</button></li>`}
          ${folders.map((folder) => html`<li><button type="button" class="folder-picker__folder row" data-path="${folder.path}">${icon('folder')}<span class="breaks">${folder.name}</span></button></li>`)}
        </ul>
        ${!path && folders.length === 0 && html`<p class="pad-row">${t('add.no_folders')}</p>`}
      </div>`,
    );
    if (hadFocus) this.parts.here.focus(); // the button is gone
  }
}

customElements.define('folder-picker', FolderPicker);
