/** Adds films of the server to the archive: a dry run first, then the films themselves. */

import { ApiError, post } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { Component, Store } from '../../../core/page/store.js';
import { count } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { framedPage, showFault } from '../../shared/page-frame/page-frame.js';
import '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import '../../shared/pager/pager.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { additionColumns, additionSummary } from './additions.js';
import './folder-picker.js';

/** A page of rows that are all here; like a `PagedList` for the pager. */
class Pages extends Store {
  limit = 50;
  offset = 0;

  constructor() {
    super([]);
  }

  get total() {
    return this.value.length;
  }

  get page() {
    return this.value.slice(this.offset, this.offset + this.limit);
  }

  turnTo(offset) {
    this.offset = offset;
    this.dispatchEvent(new Event('change'));
  }
}

export class AddFilms extends Component {
  #pages = new Pages();
  #found = null;
  #wanted = null;

  mount() {
    /** @type {Parts<'add-films/add-films'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('archive.add'),
        content: may('admin')
          ? formMarkup()
          : html`<p class="message">${icon('info')}<span>${t('add.admin')}</span></p>`,
      }),
    );
    if (!may('admin')) return;
    const { parts } = this;
    parts.table.fill({ caption: t('add.dry_run'), columns: additionColumns(), keyOf: ({ path }) => path });
    parts.pager.fill(this.#pages);
    this.listen(this.#pages, 'change', () => parts.table.show(this.#pages.page));
    this.listen(parts.form, 'submit', (event) => {
      event.preventDefault();
      orToast(() => this.#preview());
    });
    this.listen(parts.problems, 'change', () => this.#showFilms());
    this.listen(parts.add, 'click', () => orToast(() => this.#add()));
  }

  async #preview() {
    const { parts } = this;
    const { value: folder } = parts.folder;
    parts.fault.replaceChildren();
    parts.folderFault.textContent = folder ? '' : t('add.folder_needed');
    if (!folder) {
      parts.folder.querySelector('button')?.focus();
      return;
    }
    const [file] = parts.header.files;
    const wanted = {
      paths: [folder],
      ...(file && { header_csv: await file.text() }),
      ...(parts.priority.value !== '' && { priority: Number(parts.priority.value) }),
    };
    await this.#during(parts.look, async () => {
      this.#found = await post('/api/archive/films/preview', wanted, this.signal);
      this.#wanted = wanted;
      parts.folder.remember();
      this.#showResult();
    });
  }

  async #add() {
    await this.#during(this.parts.add, async () => {
      await post('/api/archive/films', this.#wanted, this.signal);
      location.assign('/films?sort=added_at&descending=true');
    });
  }

  /** Runs a request of a button; a refusal is shown above the form, where the person wrote. */
  async #during(button, run) {
    button.disabled = true;
    try {
      await run();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      showFault(this.parts.fault, error, { isAskedAgain: false });
      this.parts.result.hidden = true;
    } finally {
      button.disabled = false;
    }
  }

  #showResult() {
    const { parts } = this;
    const { new: added } = this.#found;
    parts.result.hidden = false;
    render(parts.summary, additionSummary(this.#found));
    parts.problems.checked = false;
    parts.addWord.textContent = t('add.submit', { n: added, count: count(added) });
    parts.add.hidden = added === 0;
    this.#showFilms();
    parts.resultTitle.focus();
  }

  #showFilms() {
    const { films } = this.#found;
    this.#pages.offset = 0;
    this.#pages.set(this.parts.problems.checked ? films.filter(({ problem }) => problem) : [...films]);
  }
}

const formMarkup =
  () => html`<p class="dim below-4">${t('add.help')} <a href="/films/rules">${t('archive.rules')}</a></p>
  <form class="panel add__form one-if-narrow stack gap-4 at-top pad-4" data-part="form" novalidate>
    <div class="field"><span class="label">${t('add.folder')}</span>
      <folder-picker data-part="folder"></folder-picker>
      <span class="fault" role="alert" data-part="folderFault"></span>
      <span class="help">${t('add.folder_help')}</span></div>
    <div class="field"><label for="add-header">${t('add.header')} <span class="required">${t('page.optional')}</span></label>
      <input class="input" id="add-header" type="file" accept=".csv,text/csv" aria-describedby="add-header-help" data-part="header" />
      <span class="help" id="add-header-help">${t('add.header_help')}</span></div>
    <div class="field"><label for="add-priority">${t('archive.priority')} <span class="required">${t('page.optional')}</span></label>
      <input class="input" id="add-priority" type="number" min="-9" max="9" step="1" aria-describedby="add-priority-help" data-part="priority" />
      <span class="help" id="add-priority-help">${t('archive.priority_help')}</span></div>
    <button class="button button--primary" data-part="look">${icon('search')}${t('add.look')}</button>
  </form>
  <section data-part="result" hidden>
    <div class="content__head"><div><h2 tabindex="-1" data-part="resultTitle">${t('add.dry_run')}</h2><div data-part="summary"></div></div>
      <div class="content__ways"><label class="inline-row"><input type="checkbox" data-part="problems" /> ${t('add.only_problems')}</label>
        <button class="button button--primary" data-part="add">${icon('plus')}<span data-part="addWord"></span></button></div></div>
    <data-table class="additions" data-part="table"></data-table>
    <list-pager data-part="pager"></list-pager>
  </section>`;

customElements.define('add-films', AddFilms);
