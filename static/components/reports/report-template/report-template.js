/** The template of a project's reports; without ?project=NAME the one of all projects without their own. */

import { ApiError, get, poll } from '../../../core/server/api.js';
import { makeExport, save } from '../../../core/survey/exports.js';
import { html, render } from '../../../core/page/html.js';
import {
  LEAST_CONTRAST,
  TemplateDraft,
  contrastOnWhite,
  loadTemplate,
  projectsWithTemplate,
  removeTemplate,
  saveTemplate,
} from '../../../core/survey/report-template.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { date } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { framedPage, showFault, showOvertaken } from '../../shared/page-frame/page-frame.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { MOST_BLOCKS, addBlock, blockTitles, faultyIn, followBlocks, showBlocks } from './blocks.js';
import { logoAddress, logoOf } from './logo.js';
import { followSections, showSections } from './section-list.js';

const GRADES = ['own', 'structural', 'none'];
/** Inspections that the preview offers. */
const OFFERED = 50;

export class ReportTemplate extends Component {
  /** The project; '' is all others. */
  #project = new URLSearchParams(location.search).get('project') ?? '';
  #draft;
  /** The version that is edited; null replaces any. */
  #version = null;
  #changes = null;

  mount() {
    /** @type {Parts<'report-template/report-template'>} */
    this.parts = render(
      this,
      framedPage({
        title: this.#project === '' ? t('report_template.of_all') : t('report_template.of', { project: this.#project }),
        ways: html`<p class="template__state strong weak" role="status" data-part="state"></p>
          <button class="button button--icon" data-part="undo" data-needs="operator" disabled aria-label="${t('page.undo')}" title="${t('page.undo')}">${icon('undo')}</button>
          <button class="button button--icon" data-part="redo" data-needs="operator" disabled aria-label="${t('report_template.redo')}" title="${t('report_template.redo')}">${icon('redo')}</button>
          <button class="button" data-part="reset" data-needs="operator" hidden>${icon('trash')}<span data-part="resetWord"></span></button>
          <button class="button button--primary" data-part="save" data-needs="operator" disabled>${icon('check')}${t('rules.save')}</button>`,
        content: html`<p class="dim template__help"><span data-part="whose"></span> <span data-part="changed"></span></p>
          <nav class="template__others" aria-label="${t('report_template.others')}" data-part="others"></nav>
          <div role="alert" data-part="refused"></div>
          <fieldset class="template stack gap-4 halves at-top shrinks" data-part="form" hidden ${!may('operator') && 'disabled'}>${formMarkup()}</fieldset>
          <section class="panel template__preview" aria-labelledby="template-preview" data-part="preview" hidden>${previewMarkup()}</section>`,
      }),
    );
    this.#listen();
    poll(
      () => this.#load(),
      this.signal,
      (error) => showFault(this.parts.fault, error),
    );
  }

  /** Fetches all that is shown, the template at last: what is edited is not replaced by a repeated question. */
  async #load() {
    const [used, codes] = await Promise.all([loadTemplate(this.#project, this.signal), get('/api/codes', this.signal)]);
    await this.#offer();
    const names = [...new Set(codes.map(({ code }) => code))];
    render(this.parts.codes, html`${names.map((code) => html`<option value="${code}"></option>`)}`);
    this.#take(used);
    showFault(this.parts.fault, null);
    return null;
  }

  #listen() {
    const { parts } = this;
    /** @type {Component['listen']} */
    const listen = (...args) => this.listen(...args);
    const draftOf = () => this.#draft;
    followSections(parts.sections, draftOf, listen);
    followBlocks(parts.blocks, draftOf, listen);
    listen(parts.form, 'input', ({ target }) => this.#typed(target));
    listen(parts.file, 'change', () => orToast(() => this.#readLogo()));
    listen(parts.noLogo, 'click', () => this.#draft.change({ logo: '' }));
    listen(parts.add, 'click', () => addBlock(parts.blocks, this.#draft));
    listen(parts.undo, 'click', () => this.#draft.undo());
    listen(parts.redo, 'click', () => this.#draft.redo());
    listen(parts.save, 'click', () => orToast(() => this.#save()));
    listen(parts.reset, 'click', () => orToast(() => this.#reset()));
    listen(parts.previewForm, 'submit', (event) => {
      event.preventDefault();
      orToast(() => this.#preview());
    });
    listen(window, 'beforeunload', (event) => this.#draft?.isChanged && event.preventDefault());
  }

  /** Shows what the server has. */
  #take(used) {
    this.#noteStored(used);
    this.#draft = new TemplateDraft(used.template);
    this.#changes?.abort();
    this.#changes = new AbortController();
    this.#draft.addEventListener('change', () => this.#changed(), { signal: this.#changes.signal });
    this.parts.form.hidden = false;
    this.#changed();
  }

  #noteStored({ project, version, changed_at: at, changed_by: who }) {
    const { parts } = this;
    this.#version = version;
    const isOwn = project === this.#project;
    parts.reset.hidden = !isOwn;
    parts.resetWord.textContent = this.#project === '' ? t('report_template.reset_all') : t('report_template.reset');
    parts.whose.textContent = isOwn
      ? this.#project === ''
        ? t('report_template.is_of_all')
        : t('report_template.is_own')
      : project === ''
        ? t('report_template.is_common')
        : t('report_template.is_default');
    parts.changed.textContent = at ? t('report_template.changed', { who, at: date(at) }) : '';
  }

  #changed() {
    const { parts } = this;
    const draft = this.#draft;
    const { isChanged, value } = draft;
    parts.state.textContent = isChanged ? t('rules.unsaved') : '';
    parts.save.disabled = !isChanged;
    parts.undo.disabled = !draft.canUndo;
    parts.redo.disabled = !draft.canRedo;
    parts.accentFault.textContent =
      contrastOnWhite(value.accent) < LEAST_CONTRAST ? t('report_template.accent_light') : '';
    parts.add.disabled = value.recommendations.length >= MOST_BLOCKS;
    if (!draft.isTyped) this.#fill(value);
  }

  #fill(value) {
    const { parts } = this;
    for (const field of this.querySelectorAll('[data-name]')) {
      if (field.type === 'checkbox') field.checked = value[field.dataset.name];
      else field.value = value[field.dataset.name];
    }
    showSections(parts.sections, value.sections, may('operator'));
    showBlocks(parts.blocks, value);
    parts.noBlocks.hidden = value.recommendations.length > 0;
    parts.table.hidden = value.recommendations.length === 0;
    parts.logoShown.hidden = parts.noLogo.hidden = value.logo === '';
    if (value.logo !== '') parts.logoShown.src = logoAddress(value.logo);
  }

  #typed(field) {
    const { name } = field.dataset;
    if (name) this.#draft.change({ [name]: field.type === 'checkbox' ? field.checked : field.value }, field);
  }

  async #readLogo() {
    const { file, logoFault } = this.parts;
    const [chosen] = file.files;
    if (!chosen) return;
    const logo = await logoOf(chosen);
    file.value = '';
    logoFault.textContent = logo === null ? t('report_template.logo_fault') : '';
    if (logo !== null) this.#draft.change({ logo });
  }

  async #save() {
    const { parts } = this;
    const faulty = faultyIn(parts.blocks);
    if (faulty) {
      faulty.setAttribute('aria-invalid', 'true');
      faulty.focus();
      this.#refuse(t('report_template.block_fault', { n: Number(faulty.closest('[data-place]').dataset.place) + 1 }));
      return false;
    }
    parts.save.disabled = true;
    try {
      const used = await saveTemplate(this.#project, this.#draft.template, this.#version);
      this.#noteStored(used);
      this.#draft.keep(used.template);
      render(parts.refused, html``);
      toast(t('report_template.saved'));
      await this.#offer();
      return true;
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.#changed();
      if (error.isOvertaken) this.#overtaken(error);
      else this.#refuse(errorText(error));
      return false;
    }
  }

  #overtaken({ version }) {
    showOvertaken(this.parts.refused, t('report_template.overtaken'), {
      theirs: () =>
        orToast(async () => {
          this.#take(await loadTemplate(this.#project, this.signal));
          render(this.parts.refused, html``);
        }),
      mine: async () => {
        this.#version = version; // null: it was taken away meanwhile
        await this.#save();
      },
    });
  }

  #refuse(text) {
    render(this.parts.refused, message('error', text));
  }

  /** Goes back to the template of all others, or to the defaults; what was stored and what was typed can be brought back. */
  async #reset() {
    const { value, isChanged } = this.#draft;
    const { template } = await loadTemplate(this.#project, this.signal);
    await removeTemplate(this.#project, this.#version);
    this.#take(await loadTemplate(this.#project, this.signal));
    toast(t('report_template.is_reset'), {
      action: t('page.undo'),
      run: () =>
        orToast(async () => {
          this.#take(await saveTemplate(this.#project, template, null));
          if (isChanged) this.#draft.change(value);
          await this.#offer();
        }),
    });
    await this.#offer();
  }

  /** Offers the other templates, and the inspections of this one for a preview. */
  async #offer() {
    const { parts, signal } = this;
    const query = new URLSearchParams({
      limit: String(OFFERED),
      ...(this.#project !== '' && { project: this.#project }),
    });
    const [projects, { inspections }] = await Promise.all([
      projectsWithTemplate(signal),
      get(`/api/inspections?${query}`, signal),
    ]);
    const all = [...new Set(['', ...projects])];
    render(
      parts.others,
      html`${
        all.length > 1 &&
        html`<ul>${all.map(
          (
            project,
          ) => html`<li><a class="chip" href="/settings/template${project && `?${new URLSearchParams({ project })}`}"
        ${project === this.#project && html`aria-current="page"`}>${project || t('report_template.of_all')}</a></li>`,
        )}</ul>`
      }`,
    );
    const mine = inspections.filter(({ project }) => this.#project !== '' || !projects.includes(project));
    render(parts.inspection, html`${mine.map(({ id, name }) => html`<option value="${id}">${name}</option>`)}`);
    parts.preview.hidden = mine.length === 0;
  }

  async #preview() {
    const { parts } = this;
    if (this.#draft.isChanged && may('operator') && !(await this.#save())) return;
    parts.show.disabled = true;
    parts.making.hidden = false;
    try {
      save(await makeExport(parts.inspection.value, 'pdf', [], this.signal));
    } finally {
      parts.show.disabled = false;
      parts.making.hidden = true;
    }
  }
}

function formMarkup() {
  const titles = blockTitles('');
  return html`<section class="panel template__part" aria-labelledby="template-company"><h2 id="template-company">${t('report_template.company')}</h2>
      ${line('company_name', 200, t('report_template.company_help'))}
      ${lines('company_address', 3)}
      <div class="field"><span class="label" id="template-logo">${t('report_template.field.logo')}</span>
        <div class="template__logo row gap-3 wrap"><img alt="${t('report_template.logo_alt')}" data-part="logoShown" hidden />
          <label class="button" data-needs="operator">${icon('upload')}${t('report_template.logo_choose')}<input class="visually-hidden" type="file" accept="image/*" data-part="file" /></label>
          <button type="button" class="button" data-part="noLogo" data-needs="operator" hidden>${icon('trash')}${t('report_template.logo_none')}</button></div>
        <span class="fault" role="alert" data-part="logoFault"></span><span class="help">${t('report_template.logo_help')}</span></div>
      <div class="field"><label for="template-accent">${t('report_template.field.accent')}</label>
        <input class="input template__accent" id="template-accent" type="color" data-name="accent" aria-describedby="template-accent-fault" />
        <span class="fault" id="template-accent-fault" role="alert" data-part="accentFault"></span></div></section>
    <section class="panel template__part" aria-labelledby="template-sections"><h2 id="template-sections">${t('report_template.sections')}</h2>
      <p class="help">${t('report_template.sections_help')}</p>
      <ol class="sections" data-part="sections"></ol></section>
    <section class="panel template__part" aria-labelledby="template-texts"><h2 id="template-texts">${t('report_template.texts')}</h2>
      ${lines('introduction', 5, t('report_template.introduction_help'))}
      ${lines('closing', 5, t('report_template.closing_help'))}</section>
    <section class="panel template__part" aria-labelledby="template-grade"><h2 id="template-grade">${t('report_template.grading')}</h2>
      <div class="field"><label for="template-grade-rule">${t('report_template.field.grade')}</label>
        <select class="input" id="template-grade-rule" data-name="grade">${GRADES.map((rule) => html`<option value="${rule}">${wordFor('report_template.grade', rule)}</option>`)}</select></div>
      <label class="switch row"><input type="checkbox" data-name="costs" /><span>${t('report_template.costs')}</span></label>
      ${line('currency', 8)}</section>
    <section class="panel template__part template__part--wide" aria-labelledby="template-blocks"><h2 id="template-blocks">${t('report_template.blocks')}</h2>
      <p class="help">${t('report_template.blocks_help')}</p>
      <p class="dim" data-part="noBlocks" hidden>${t('report_template.no_blocks')}</p>
      <datalist id="template-codes" data-part="codes"></datalist>
      <table class="blocks" data-part="table" hidden><thead><tr>${Object.values({ ...titles, cost: t('report_template.cost') }).map((title) => html`<th scope="col">${title}</th>`)}
        <th scope="col" data-needs="operator"><span class="visually-hidden">${t('report_template.ways')}</span></th></tr></thead><tbody data-part="blocks"></tbody></table>
      <button type="button" class="button" data-part="add" data-needs="operator">${icon('plus')}${t('report_template.block_add')}</button></section>`;
}

function titled(name, control, help) {
  return html`<div class="field"><label for="template-${name}">${wordFor('report_template.field', name)}</label>${control}
  ${help && html`<span class="help" id="template-${name}-help">${help}</span>`}</div>`;
}

const described = (name, help) => help && html`aria-describedby="template-${name}-help"`;

const line = (name, longest, help) =>
  titled(
    name,
    html`<input class="input" id="template-${name}" data-name="${name}" maxlength="${longest}" autocomplete="off" ${described(name, help)} />`,
    help,
  );

const lines = (name, rows, help) =>
  titled(
    name,
    html`<textarea class="input" id="template-${name}" rows="${rows}" maxlength="4000" data-name="${name}" ${described(name, help)}></textarea>`,
    help,
  );

const previewMarkup = () => html`<h2 id="template-preview">${t('report_template.preview')}</h2>
  <form class="template__show flow gap-3 at-bottom" data-part="previewForm"><div class="field"><label for="template-inspection">${t('report_template.inspection')}</label>
    <select class="input" id="template-inspection" data-part="inspection"></select></div>
    <button class="button" data-part="show">${icon('download')}${t('report_template.show')}</button></form>
  <p class="help">${t('report_template.preview_help')}</p>
  <p role="status" data-part="making" hidden>${t('export.making')}</p>`;

customElements.define('report-template', ReportTemplate);
