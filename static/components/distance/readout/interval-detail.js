/** The sources of the interval of a distance, what would reduce it most, and the effect of the joints. */

import { get, refusalIn } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { LEAST_M, chainage, plusMinus } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';

/**
 * @typedef {object} UncertaintyBudget
 * @property {number} frame
 * @property {number} distance_m
 * @property {number} distance_u95_m
 * @property {{name: string, u95_m: number}[]} parts the largest first; they add up in quadrature
 * @property {{length_m: number, u95_m: number}|null} taped the effect of one more taped length
 */

/**
 * @param {string} inspection
 * @param {number|null} frame null: the furthest one
 * @returns {Promise<UncertaintyBudget|null>} null where the interval is unknown
 */
export async function loadBudget(inspection, frame, signal) {
  const query = frame === null ? '' : `?frame=${frame}`;
  return (await get(`/api/inspections/${inspection}/interval${query}`, signal)).interval;
}

/** @param {UncertaintyBudget} budget */
export function budgetMarkup({ distance_u95_m: u95M, parts, taped }) {
  const most = parts[0]?.u95_m || 1;
  return html`<table class="budget number">
      <caption class="visually-hidden">${t('interval.made_of')}</caption>
      <tbody>${parts.map(
        ({ name, u95_m: part }) => html`<tr><th scope="row">${wordFor('interval.part', name)}</th>
        <td>${plusMinus(part)}</td><td class="budget__bar"><meter min="0" max="${most}" value="${part}"
          aria-hidden="true"></meter></td></tr>`,
      )}</tbody>
    </table>
    <p class="row at-top strong">${icon('stretch')}<span>${advice(u95M, parts, taped)}</span></p>`;
}

function advice(u95M, parts, taped) {
  if (taped) {
    const [length, now, then] = [chainage(taped.length_m), plusMinus(u95M), plusMinus(taped.u95_m)];
    return t('interval.tape', { length, now, then });
  }
  const worth = u95M > LEAST_M ? parts[0] : null;
  return (worth && wordFor('interval.work', worth.name)) ?? t('interval.nothing');
}

/**
 * '5 joints: scale 0.9914 ± 0.0005. Your camera sits 2 mm lower…'; with measured lengths, what set the scale.
 * @param {{of?: string, joints: number, lengths?: number, scale: number, sigma: number, lower_mm: number|null}} done
 */
export function jointsText({ of, joints, lengths = 0, scale, sigma, lower_mm: lowerMm }) {
  const figures = { scale: scale.toFixed(4), sigma: Math.max(sigma, 0.0001).toFixed(4) };
  if (of === 'crests') return t('interval.by_crests', { n: joints, ...figures });
  if (lengths) return t('interval.by_lengths', { n: lengths, joints, ...figures });
  const done = t('interval.by_joints', { n: joints, ...figures });
  const mm = lowerMm === null ? 0 : Math.round(Math.abs(lowerMm));
  if (mm === 0) return done;
  return `${done} ${lowerMm > 0 ? t('interval.lower', { mm }) : t('interval.higher', { mm })}`;
}

/** Shows the interval of the frame on the screen. */
export async function openIntervalDetail(desk) {
  const { frame, row } = desk.playhead.value;
  const { dialog, parts } = openDialog({
    title: t('interval.title'),
    content: html`<div class="stack gap-3" data-part="body" aria-busy="true"><p class="dim">${t('interval.loading')}</p></div>`,
  });
  const closing = new AbortController();
  dialog.addEventListener('close', () => closing.abort());
  try {
    const budget = row && (await loadBudget(desk.inspection.value.id, frame, closing.signal));
    render(
      parts.body,
      budget ? bodyMarkup(budget, desk.corrections.value?.result) : html`<p>${t('interval.unknown')}</p>`,
    );
  } catch (error) {
    const refusal = refusalIn(error);
    if (refusal) render(parts.body, html`<p class="fault">${errorText(refusal)}</p>`);
  }
  parts.body.removeAttribute('aria-busy');
}

const bodyMarkup = (budget, result) => html`<p class="budget__whole number"><b>${chainage(budget.distance_m)}</b>
    ${plusMinus(budget.distance_u95_m)} <span class="dim">(95 %)</span></p>
  ${budgetMarkup(budget)}
  ${result?.by_joints && html`<p>${jointsText(result.by_joints)}</p>`}
  <p class="help">${t('interval.help')}</p>`;
