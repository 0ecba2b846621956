/** The result of all statements: the far end, its class, the scale and the residual of each evidence. */

import { UNSTATED } from '../../../core/survey/corrections.js';
import { evidenceText, isOfJoints } from '../../../core/survey/evidence.js';
import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { refusalIn } from '../../../core/server/api.js';
import { chainage, plusMinus, withSign } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { loadBudget, budgetMarkup } from '../readout/interval-detail.js';

const U95 = 1.96;
/** Lengths that differ less than this are shown as equal. */
const SAME_M = 0.00005;

export class CorrectionOutcome extends Component {
  /** Distance of the far end in the raw track. */
  #rawM = null;
  #measuredRows = -1;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'corrections/outcome'>} */
    this.parts = render(
      this,
      html`<dl class="ends-of-run flow number">
          <div><dt class="small dim">${t('corrections.as_measured')}</dt><dd data-part="raw"></dd></div>
          <div><dt class="small dim" data-part="nowTerm">${t('corrections.now')}</dt><dd data-part="now"></dd></div>
          <div data-part="thenBox" class="ends-of-run__then"><dt class="small dim">${t('corrections.then')}</dt><dd data-part="then"></dd></div>
        </dl>
        <div data-part="notices"></div>
        <div data-part="class"></div>
        <details class="evidence" data-part="budgetBox" open hidden><summary>${t('interval.made_of')}</summary>
          <div class="stack gap-3" data-part="budget"></div></details>
        <details class="evidence" data-part="details" hidden><summary>${t('corrections.how')}</summary>
          <div data-part="evidence"></div></details>`,
    );
    const { desk } = this;
    this.listen(desk.corrections, 'change', () => {
      this.#show();
      this.#explain();
    });
    this.listen(desk.corrections.preview, 'change', () => this.#show());
    this.listen([desk.inspection, desk.track], 'change', () => this.#measure());
    this.#measure();
    this.#show();
    this.#explain();
  }

  /** Computes the far end without joints or statements; requested once for each length of the track. */
  async #measure() {
    const { desk } = this;
    const rows = desk.track.length;
    if (desk.inspection.isUnfinished || rows === this.#measuredRows || rows === 0) return;
    this.#measuredRows = rows;
    try {
      const without = { ...UNSTATED, joints: { ...UNSTATED.joints, use: false } };
      const { result } = await desk.corrections.ask(without, this.signal);
      this.#rawM = result?.distance_class.length_m ?? null;
    } catch (error) {
      refusalIn(error);
    }
    this.#show();
  }

  /** Shows the sources of the interval at the far end, by the present distances. */
  async #explain() {
    const { parts, desk } = this;
    try {
      const budget = await loadBudget(desk.inspection.value.id, null, this.signal);
      parts.budgetBox.hidden = budget === null;
      if (budget) render(parts.budget, budgetMarkup(budget));
    } catch (error) {
      refusalIn(error);
    }
  }

  #show() {
    const { parts } = this;
    const { corrections } = this.desk;
    const { preview, isEdited, value: held } = corrections;
    this.classList.toggle('outcome--waiting', preview.value === null);
    parts.raw.textContent = chainage(this.#rawM);
    showEnd(parts.now, held?.result);
    parts.thenBox.hidden = !isEdited;
    if (isEdited) showEnd(parts.then, preview.value?.result);
    if (preview.value === null) return; // the earlier figures stay until the new ones arrive
    const { result } = preview.value;
    render(
      parts.notices,
      html`${(result?.notices ?? []).map(
        (notice) =>
          html`<p class="message message--warning">${icon('alert')}<span>${wordFor('notice', notice.code, notice.params)}</span></p>`,
      )}`,
    );
    render(parts.class, result ? classMarkup(result.distance_class) : html``);
    parts.details.hidden = !result?.findings.length;
    if (!parts.details.hidden) render(parts.evidence, this.#evidence(result));
  }

  /** @param {import('../../../core/survey/corrections.js').Result} result */
  #evidence({ findings, residuals, joints, scale, scale_sigma: sigma, height }) {
    const { height_mm: stated } = this.desk.inspection.value.rig.mount;
    const left = new Map(residuals.map(({ name, residual_mm: mm }) => [name, mm]));
    return html`<table class="tally number">
        <thead><tr><th scope="col">${t('corrections.evidence_of')}</th><th scope="col">${t('corrections.scale')}</th>
          <th scope="col">${t('corrections.residual')}</th></tr></thead>
        <tbody>${findings.map(
          (found) => html`<tr><th scope="row">${evidenceText(found.evidence)}</th>
          <td>${scaleText(found)}</td><td>${leftText(found.evidence, left, joints)}</td></tr>`,
        )}</tbody>
        <tfoot><tr><th scope="row">${t('corrections.together')}</th><td>${scaleText({ scale, sigma })}</td><td></td></tr></tfoot>
      </table>
      ${
        height &&
        html`<p class="number">${t('corrections.height', {
          implied: height.height_mm.toFixed(1),
          u95: (U95 * height.sigma_mm).toFixed(1),
          stated: stated.toFixed(1),
        })}</p>`
      }`;
  }
}

function showEnd(element, result) {
  const end = result?.distance_class;
  render(
    element,
    end
      ? html`${chainage(end.length_m)} <span class="dim">${plusMinus(end.half_width_m)}</span>`
      : html`${chainage(null)}`,
  );
}

function classMarkup({ percent, half_width_m: halfWidth, residual_m: residual, length_m: length }) {
  const isMet = percent !== null;
  const text = isMet ? t('corrections.class_met', { percent }) : t('corrections.class_not_met');
  const rests =
    residual === null
      ? t('corrections.class_rests_open', { half: plusMinus(halfWidth) })
      : t('corrections.class_rests', { half: plusMinus(halfWidth), residual: `${withSign(1000 * residual, 0)} mm` });
  return html`<div class="class row at-top ${isMet ? 'sign-ok' : 'sign-weak'}">${icon(isMet ? 'check' : 'alert')}
    <div><p><b>${text}</b></p><p class="dim number">${rests} ${t('corrections.class_length', { length: chainage(length) })}</p></div></div>`;
}

const scaleText = ({ scale, sigma }) =>
  sigma === null
    ? scale.toFixed(4)
    : t('corrections.scale_value', { scale: scale.toFixed(4), sigma: sigma < SAME_M ? '0.0001' : sigma.toFixed(4) });

/** Formats the residual of a length; of joints their root mean square. */
function leftText(evidence, left, joints) {
  if (left.has(evidence)) return `${withSign(left.get(evidence), 1)} mm`;
  if (!isOfJoints(evidence) || joints.length === 0 || joints[0].residual_mm === null) return '';
  const squares = joints.reduce((sum, { residual_mm: mm }) => sum + mm * mm, 0);
  return t('corrections.rms', { mm: Math.sqrt(squares / joints.length).toFixed(1) });
}

customElements.define('correction-outcome', CorrectionOutcome);
