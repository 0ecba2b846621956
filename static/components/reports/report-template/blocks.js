/** The blocks of text that are proposed as recommendations. */

import { html, render } from '../../../core/page/html.js';
import { moved } from '../../../core/survey/report-template.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { toast } from '../../shared/toast-stack/toast-stack.js';

export const MOST_BLOCKS = 500;
const SEVERITIES = [0, 1, 2, 3, 4, 5];
const CODE = /^[A-Z][A-Z0-9]{0,7}$/;
const CHARACTER = /^[A-Z][A-Z0-9]{0,3}$/;

/** Returns the value of a control for the API, undefined if it is none. */
const VALUES = {
  code: (text) => orNull(text.trim().toUpperCase(), CODE),
  char1: (text) => orNull(text.trim().toUpperCase(), CHARACTER),
  severity_from: Number,
  text: (text) => text.trim() || undefined,
  cost: (text) => (text === '' ? null : Number(text) >= 0 ? Number(text) : undefined),
};

function orNull(text, pattern) {
  if (text === '') return null;
  return pattern.test(text) ? text : undefined;
}

/**
 * Keeps the table in step with a draft.
 * @param {HTMLElement} body a <tbody>
 * @param {() => import('../../../core/survey/report-template.js').TemplateDraft} draftOf
 * @param {import('../../../core/page/store.js').Component['listen']} listen
 */
export function followBlocks(body, draftOf, listen) {
  const placeOf = (element) => Number(element.closest('[data-place]').dataset.place);
  const put = (recommendations) => draftOf().change({ recommendations });
  listen(body, 'input', ({ target }) => {
    const { field } = target.dataset;
    const value = VALUES[field](target.value);
    target.setAttribute('aria-invalid', String(value === undefined));
    if (value === undefined) return;
    const place = placeOf(target);
    const blocks = draftOf().value.recommendations.map((block, i) =>
      i === place ? { ...block, [field]: value } : block,
    );
    draftOf().change({ recommendations: blocks }, target);
  });
  listen(body, 'click', ({ target }) => {
    const { do: what } = target.closest('[data-do]')?.dataset ?? {};
    if (!what) return;
    const place = placeOf(target);
    const blocks = draftOf().value.recommendations;
    if (what === 'remove') {
      put(blocks.toSpliced(place, 1));
      (body.children[Math.min(place, blocks.length - 2)] ?? body.closest('section'))
        .querySelector('textarea, [data-part=add]')
        ?.focus();
      toast(t('report_template.removed'), {
        action: t('page.undo'),
        run: () => put(draftOf().value.recommendations.toSpliced(place, 0, blocks[place])),
      });
      return;
    }
    const to = place + (what === 'up' ? -1 : 1);
    put(moved(blocks, place, to));
    body.children[to].querySelector(`[data-do=${what}]:not(:disabled), textarea`).focus();
  });
}

/** Adds an empty block, whose text is typed next. */
export function addBlock(body, draft) {
  const empty = { text: '', code: null, char1: null, severity_from: 0, cost: null };
  draft.change({ recommendations: [...draft.value.recommendations, empty] });
  body.lastElementChild.querySelector('[data-field=code]').focus();
}

/** The first control that does not hold what it should, or null. */
export const faultyIn = (body) => body.querySelector('[aria-invalid=true], textarea:placeholder-shown');

/**
 * @param {HTMLElement} body
 * @param {import('../../../core/survey/report-template.js').Template} template
 */
export function showBlocks(body, { recommendations, currency }) {
  const titles = blockTitles(currency);
  const last = recommendations.length - 1;
  const cell = (name, control) => html`<td data-title="${titles[name]}">${control}</td>`;
  render(
    body,
    html`${recommendations.map(({ code, char1, severity_from: from, text, cost }, i) => {
      const named = (name) => t('report_template.of_block', { field: titles[name], n: i + 1 });
      const word = (name, value, longest) =>
        cell(
          name,
          html`<input class="input" data-field="${name}" value="${value ?? ''}" maxlength="${longest}" list="template-${name}s" aria-label="${named(name)}" autocomplete="off" spellcheck="false" />`,
        );
      return html`<tr data-place="${i}">
        ${word('code', code, 8)}
        ${word('char1', char1, 2)}
        ${cell('severity_from', html`<select class="input" data-field="severity_from" aria-label="${named('severity_from')}">${SEVERITIES.map((n) => html`<option value="${n}" ${n === from && 'selected'}>${n} ${wordFor('severity', String(n))}</option>`)}</select>`)}
        ${cell('text', html`<textarea class="input" rows="2" maxlength="1000" data-field="text" aria-label="${named('text')}" placeholder="${t('report_template.block_text_help')}">${text}</textarea>`)}
        ${cell('cost', html`<input class="input" type="number" min="0" max="1000000000" step="any" data-field="cost" value="${cost ?? ''}" aria-label="${named('cost')}" autocomplete="off" />`)}
        <td data-needs="operator"><span class="row gap-1">
          <button type="button" class="button button--small button--icon" data-do="up" ${i === 0 && 'disabled'} aria-label="${t('report_template.block_up', { n: i + 1 })}" title="${t('rules.earlier')}">↑</button>
          <button type="button" class="button button--small button--icon" data-do="down" ${i === last && 'disabled'} aria-label="${t('report_template.block_down', { n: i + 1 })}" title="${t('rules.later')}">↓</button>
          <button type="button" class="button button--small button--icon" data-do="remove" aria-label="${t('report_template.block_remove', { n: i + 1 })}" title="${t('rules.remove')}">${icon('trash')}</button></span></td></tr>`;
    })}`,
  );
}

/** Titles of the columns by the field. */
export const blockTitles = (currency) => ({
  code: t('report_template.block_code'),
  char1: t('report_template.block_char'),
  severity_from: t('report_template.block_severity'),
  text: t('report_template.block_text'),
  cost: t('report_template.block_cost', { currency }),
});
