/** The form of one rule. */

import { html } from '../../../core/page/html.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const TEMPLATES = [
  ['project', t('archive.project')],
  ['asset', t('archive.asset')],
  ['name_of_film', t('rules.film_name')],
];

/**
 * @param {object} rule
 * @param {number} i its place
 * @param {{rules: object[], names: string[], fields: object[]}} around names: those of the rigs; fields: of the header
 */
export function ruleCard(rule, i, { rules, names, fields }) {
  const missing = rule.rig && !names.includes(rule.rig);
  return html`<div class="rule__head stack gap-3 at-bottom">
      <span class="rule__number number" aria-hidden="true">${i + 1}</span>
      ${field(i, 'name', t('rules.name'), html`<input class="input" id="rule-${i}-name" value="${rule.name}" maxlength="100" autocomplete="off" data-field="name" aria-describedby="rule-${i}-name-fault" />`)}
      <span class="flow" data-needs="operator">
        <button class="button button--small button--icon" data-do="up" ${i === 0 && 'disabled'} aria-label="${t('rules.up', { name: rule.name })}" title="${t('rules.earlier')}">↑</button>
        <button class="button button--small button--icon" data-do="down" ${i === rules.length - 1 && 'disabled'} aria-label="${t('rules.down', { name: rule.name })}" title="${t('rules.later')}">↓</button>
        <button class="button button--small button--icon" data-do="remove" aria-label="${t('rules.remove_named', { name: rule.name })}" title="${t('rules.remove')}">${icon('trash')}</button></span>
    </div>
    ${field(i, 'pattern', t('rules.pattern'), html`<input class="input mono" id="rule-${i}-pattern" value="${rule.pattern}" maxlength="1000" autocomplete="off" spellcheck="false" data-field="pattern" aria-describedby="rule-${i}-pattern-fault rule-${i}-pattern-help" />`, t('rules.pattern_help', { field: '{asset}', example: '{project}/{asset}_*.mp4' }))}
    <div class="fields">
      ${field(
        i,
        'rig',
        t('archive.rig'),
        html`<select class="input" id="rule-${i}-rig" data-field="rig" aria-describedby="rule-${i}-rig-fault">
        <option value="">${t('rules.no_rig')}</option>${[...(missing ? [rule.rig] : []), ...names].map((name) => html`<option value="${name}" ${name === rule.rig && 'selected'}>${name}</option>`)}</select>`,
      )}
      ${field(i, 'priority', t('archive.priority'), html`<input class="input" id="rule-${i}-priority" type="number" min="-9" max="9" step="1" value="${rule.priority ?? 0}" data-field="priority" aria-describedby="rule-${i}-priority-fault" />`)}
    </div>
    <details class="rule__more more" ${TEMPLATES.some(([name]) => rule[name]) || Object.keys(rule.header ?? {}).length ? 'open' : ''}>
      <summary>${t('rules.more')}</summary>
      <p class="help">${t('rules.template_help', { field: '{asset}' })}</p>
      <div class="fields">${TEMPLATES.map(([name, title]) => field(i, name, title, html`<input class="input" id="rule-${i}-${name}" value="${rule[name] ?? ''}" maxlength="200" autocomplete="off" placeholder="${t('rules.of_pattern')}" data-field="${name}" aria-describedby="rule-${i}-${name}-fault" />`))}</div>
      ${headerMarkup(rule.header ?? {}, i, fields)}
    </details>`;
}

function headerMarkup(header, i, fields) {
  const free = fields.filter(({ name }) => !(name in header));
  return html`<fieldset class="rule__header fields"><legend>${t('rules.header')}</legend>
    ${Object.entries(header).map(([name, value]) => {
      const known = fields.find((other) => other.name === name);
      const id = `rule-${i}-header-${name}`;
      return html`<div class="field"><label for="${id}">${wordFor('header', name) ?? name}${known?.unit && html` (${known.unit})`}</label>
        ${
          known?.kind === 'choice'
            ? html`<select class="input" id="${id}" data-header="${name}"><option value="">${t('rules.remove')}</option>${known.choices.map((choice) => html`<option value="${choice}" ${choice === value && 'selected'}>${wordFor('header.choice', choice) ?? choice}</option>`)}</select>`
            : html`<input class="input" id="${id}" value="${value}" autocomplete="off" data-header="${name}" />`
        }</div>`;
    })}
    <div class="field" data-needs="operator"><label for="rule-${i}-header-add">${t('rules.header_add')}</label>
      <select class="input" id="rule-${i}-header-add" data-header="+"><option value="">${t('header.choose')}</option>
        ${free.map(({ name }) => html`<option value="${name}">${wordFor('header', name) ?? name}</option>`)}</select></div></fieldset>`;
}

function field(i, name, title, control, help) {
  return html`<div class="field"><label for="rule-${i}-${name}">${title}</label>${control}
  <span class="fault" id="rule-${i}-${name}-fault"></span>${help && html`<span class="help" id="rule-${i}-${name}-help">${help}</span>`}</div>`;
}

/** Returns the value of a field for the API; null: it is left out. */
export function valueOf(name, input) {
  if (name === 'priority') return input.value === '' ? 0 : Number(input.value);
  const text = input.value.trim();
  return text === '' && name !== 'name' && name !== 'pattern' ? null : text;
}

/** Writes a field of the header into the rule: an emptied one is removed, '+' adds one. */
export function writeHeader(rule, input, fields) {
  const header = (rule.header ??= {});
  const name = input.dataset.header;
  if (name === '+') {
    const added = fields.find((other) => other.name === input.value);
    if (added) header[added.name] = added.choices?.[0] ?? '';
    return;
  }
  const { kind } = fields.find((other) => other.name === name) ?? {};
  const text = input.value.trim();
  if (text === '') delete header[name];
  else
    header[name] =
      kind === 'number' && Number.isFinite(Number(text)) ? Number(text) : kind === 'bool' ? text === 'true' : text;
}

/** The control of a rule that the server names; the whole rule's is its name. */
export const fieldOf = (card, name) =>
  card?.querySelector(`[data-field="${CSS.escape(name ?? 'name')}"]`) ??
  card?.querySelector('[data-field=name]') ??
  null;
