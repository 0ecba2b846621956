/** The rules of the archive: which films get which rig, project, asset and header; and the rigs. */

import { ApiError, get, poll } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { faultsIn, loadRules, saveRules } from '../../../core/survey/rules.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t } from '../../../core/page/words.js';
import { framedPage, showFault, showOvertaken } from '../../shared/page-frame/page-frame.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';
import { askRig } from './rig-dialog.js';
import { fieldOf, ruleCard, valueOf, writeHeader } from './rule-card.js';
import { tryRules } from './try-dialog.js';

export class RulesPage extends Component {
  /** {rigs, rules} as edited here. */
  #edited = { rigs: {}, rules: [] };
  #stored = '';
  #version;
  #fields = [];

  mount() {
    /** @type {Parts<'rules-page/rules-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('archive.rules'),
        ways: html`<p class="rules__state strong weak" role="status" data-part="state"></p>
          <button class="button" data-part="try" data-needs="operator" disabled>${icon('search')}${t('rules.try')}</button>
          <button class="button" data-part="discard" data-needs="operator" disabled>${icon('undo')}${t('rules.discard')}</button>
          <button class="button button--primary" data-part="save" data-needs="operator" disabled>${icon('check')}${t('rules.save')}</button>`,
        content: html`<p class="dim rules__help">${t('rules.help')}</p>
          <div role="alert" data-part="faults"></div>
          <div class="rules one-if-narrow stack gap-5 at-top" data-part="editor" hidden>
            <section aria-labelledby="rules-title"><h2 id="rules-title">${t('rules.title')}</h2>
              <p class="help">${t('rules.order')}</p>
              <p class="panel pad-4 full" data-part="noRules" hidden>${t('rules.none')}</p>
              <ol class="stack gap-3 full" data-part="rules"></ol>
              <button class="button" data-part="addRule" data-needs="operator">${icon('plus')}${t('rules.add')}</button></section>
            <section aria-labelledby="rigs-title"><h2 id="rigs-title">${t('rules.rigs')}</h2>
              <p class="help">${t('rules.rigs_help')}</p>
              <p class="panel pad-4 full" data-part="noRigs" hidden>${t('rules.no_rigs')}</p>
              <ul class="stack gap-3 full" data-part="rigs"></ul>
              <button class="button" data-part="addRig" data-needs="operator">${icon('plus')}${t('rules.add_rig')}</button>
              <details class="rules__json more full"><summary>${t('rules.json')}</summary>
                <p class="help">${t('rules.json_help')}</p>
                <label class="visually-hidden" for="rules-json">${t('rules.json')}</label>
                <textarea class="input" id="rules-json" rows="14" spellcheck="false" aria-describedby="rules-json-fault" data-part="json"></textarea>
                <span class="fault" id="rules-json-fault" role="alert" data-part="jsonFault"></span></details></section>
          </div>`,
      }),
    );
    const { parts } = this;
    this.listen(parts.rules, 'input', ({ target }) => this.#typed(target));
    this.listen(parts.rules, 'change', ({ target }) => this.#left(target));
    this.listen(this, 'click', ({ target }) => this.#clicked(target.closest('[data-do]')));
    this.listen(parts.addRule, 'click', () => this.#addRule());
    this.listen(parts.addRig, 'click', () => orToast(() => this.#editRig(null)));
    this.listen(parts.json, 'change', () => this.#readJson());
    this.listen(parts.save, 'click', () => orToast(() => this.#save()));
    this.listen(parts.discard, 'click', () => this.#show(JSON.parse(this.#stored)));
    this.listen(parts.try, 'click', () => orToast(() => tryRules(this.#edited, this.signal)));
    parts.try.hidden = !may('admin');
    this.listen(window, 'beforeunload', (event) => this.#isChanged && event.preventDefault());
    poll(
      () => this.#load(),
      this.signal,
      (error) => showFault(parts.fault, error),
    );
  }

  get #isChanged() {
    return this.#stored !== '' && JSON.stringify(this.#edited) !== this.#stored;
  }

  /** Fetches the stored rules; until they have come nothing can be edited, since they would replace it. */
  async #load() {
    const [{ fields }, stored] = await Promise.all([get('/api/header-fields', this.signal), loadRules(this.signal)]);
    this.#fields = fields;
    this.#keep(stored);
    this.#show(this.#edited);
    const { parts } = this;
    showFault(parts.fault, null);
    parts.editor.hidden = false;
    parts.try.disabled = false;
    return null;
  }

  #keep({ rigs, rules, version }) {
    this.#edited = { rigs, rules };
    this.#stored = JSON.stringify(this.#edited);
    this.#version = version;
  }

  #show(edited) {
    this.#edited = edited;
    const { parts } = this;
    const { rigs, rules } = edited;
    const names = Object.keys(rigs);
    render(
      parts.rules,
      html`${rules.map((rule, i) => html`<li class="panel rule stack gap-3 pad-4" data-rule="${i}">${ruleCard(rule, i, { rules, names, fields: this.#fields })}</li>`)}`,
    );
    render(
      parts.rigs,
      html`${names.map((name) => html`<li class="panel rig-card row gap-3 wrap apart pad-head">${rigMarkup(name, rigs[name], rules)}</li>`)}`,
    );
    parts.noRules.hidden = rules.length > 0;
    parts.noRigs.hidden = names.length > 0;
    render(parts.faults, html``);
    if (!may('operator')) for (const input of this.querySelectorAll('.rule :is(input, select)')) input.disabled = true;
    this.#showState();
  }

  #showState() {
    const { parts } = this;
    const isChanged = this.#isChanged;
    parts.state.textContent = isChanged ? t('rules.unsaved') : '';
    parts.save.disabled = !isChanged;
    parts.discard.disabled = !isChanged;
    parts.json.value = JSON.stringify(this.#edited, null, 2);
    parts.json.readOnly = !may('operator');
    parts.jsonFault.textContent = '';
  }

  #typed(input) {
    const { field, header } = input.dataset;
    const rule = this.#edited.rules[Number(input.closest('[data-rule]')?.dataset.rule)];
    if (!rule || header !== undefined || !field) return;
    const value = valueOf(field, input);
    if (value === null) delete rule[field];
    else rule[field] = value;
    this.#fault(input, '');
    this.#showState();
  }

  #left(input) {
    const index = Number(input.closest('[data-rule]')?.dataset.rule);
    const rule = this.#edited.rules[index];
    if (!rule || input.dataset.header === undefined) return;
    writeHeader(rule, input, this.#fields);
    this.#refresh(`[data-rule="${index}"] [data-header="${input.dataset.header}"]`);
  }

  /** Draws the rules again; the focus goes to the control that `selector` names. */
  #refresh(selector) {
    this.#show(this.#edited);
    this.querySelector(selector)?.focus();
  }

  #clicked(button) {
    if (!button) return;
    const { do: what, name } = button.dataset;
    const { rules, rigs } = this.#edited;
    const index = Number(button.closest('[data-rule]')?.dataset.rule);
    if (what === 'up' || what === 'down') {
      const to = index + (what === 'up' ? -1 : 1);
      rules.splice(to, 0, ...rules.splice(index, 1));
      this.#refresh(`[data-rule="${to}"] [data-do="${what}"]:not(:disabled), [data-rule="${to}"] [data-field=name]`);
    } else if (what === 'remove') {
      const [removed] = rules.splice(index, 1);
      this.#refresh(`[data-rule="${Math.max(0, index - 1)}"] [data-field=name]`);
      this.#offerUndo(t('rules.removed', { name: removed.name }), () => rules.splice(index, 0, removed));
    } else if (what === 'edit-rig') orToast(() => this.#editRig(name));
    else if (what === 'remove-rig') {
      const removed = rigs[name];
      delete rigs[name];
      this.#show(this.#edited);
      this.parts.addRig.focus();
      this.#offerUndo(t('rules.removed', { name }), () => (rigs[name] = removed));
    }
  }

  #offerUndo(text, back) {
    toast(text, { action: t('page.undo'), run: () => (back(), this.#show(this.#edited)) });
  }

  #addRule() {
    const { rules, rigs } = this.#edited;
    const [rig] = Object.keys(rigs);
    rules.push({
      name: t('rules.new_name', { n: rules.length + 1 }),
      pattern: '{project}/{asset}_*.mp4',
      ...(rig && { rig }),
      header: {},
      priority: 0,
    });
    this.#refresh(`[data-rule="${rules.length - 1}"] [data-field=name]`);
  }

  async #editRig(name) {
    const { rigs, rules } = this.#edited;
    const done = await askRig(name, rigs);
    if (!done) return;
    if (name !== null && done.name !== name) {
      for (const rule of rules) if (rule.rig === name) rule.rig = done.name;
    }
    const entries = Object.entries(rigs).filter(([other]) => other !== name);
    this.#show({ rules, rigs: Object.fromEntries([...entries, [done.name, done.rig]]) });
  }

  #readJson() {
    const { json, jsonFault } = this.parts;
    try {
      const { rigs = {}, rules = [] } = JSON.parse(json.value);
      if (!Array.isArray(rules) || Array.isArray(rigs) || typeof rigs !== 'object')
        throw new SyntaxError(t('rules.json_shape'));
      this.#show({ rigs, rules });
    } catch (error) {
      if (!(error instanceof SyntaxError || error instanceof TypeError)) throw error;
      jsonFault.textContent = error instanceof SyntaxError ? error.message : t('rules.json_shape');
    }
  }

  async #save() {
    const { parts } = this;
    parts.save.disabled = true;
    try {
      this.#keep(await saveRules(this.#edited, this.#version));
      this.#show(this.#edited);
      toast(t('rules.saved'));
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.#showState();
      if (error.isOvertaken) this.#overtaken(error);
      else this.#showFaults(error);
    }
  }

  /** Somebody else saved meanwhile: theirs is shown on request, ours stays until then. */
  #overtaken({ current, version }) {
    showOvertaken(this.parts.faults, t('rules.overtaken'), {
      theirs: () => {
        this.#keep({ ...current, version });
        this.#show(this.#edited);
      },
      mine: () => {
        this.#version = version;
        return this.#save();
      },
    });
  }

  /** Shows each fault at its field; what has none is shown above. */
  #showFaults(error) {
    const rest = [];
    let first = null;
    for (const { place, text } of faultsIn(error.message)) {
      const [kind, index, name] = place;
      const input = kind === 'rules' ? fieldOf(this.querySelector(`[data-rule="${index}"]`), name) : null;
      if (input) this.#fault(input, text);
      else rest.push([...place, text].join(': '));
      first ??= input;
    }
    const all = [...(first ? [t('rules.faults')] : []), ...(rest.length ? rest : [])];
    render(this.parts.faults, message('error', first || rest.length ? all.join(' ') : errorText(error)));
    first?.focus();
  }

  #fault(input, text) {
    input.setAttribute('aria-invalid', String(text !== ''));
    const fault = input.closest('.field').querySelector('.fault');
    if (fault) fault.textContent = text;
  }
}

function rigMarkup(name, rig, rules) {
  const { camera = {}, pipe = {} } = rig;
  const size = pipe.shape === 'circular' ? `Ø ${pipe.diameter_mm} mm` : t('rig.sketch_flat');
  const used = rules.filter((rule) => rule.rig === name).length;
  return html`<div><b>${name}</b><small class="dim">${size} · ${t('rules.rig_camera', { model: camera.model, width: camera.width, height: camera.height })}</small>
      <small class="dim">${t('rules.used', { n: used })}</small></div>
    <span class="flow" data-needs="operator">
      <button class="button button--small" data-do="edit-rig" data-name="${name}" aria-label="${t('rules.edit_named', { name })}">${icon('edit')}${t('rules.edit')}</button>
      <button class="button button--small button--icon" data-do="remove-rig" data-name="${name}" aria-label="${t('rules.remove_named', { name })}" title="${t('rules.remove')}">${icon('trash')}</button></span>`;
}

customElements.define('rules-page', RulesPage);
