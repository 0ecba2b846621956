/** Joints as marks on a tape: whether they count, which of them, and the residual of each. */

import { refusalText } from '../../../core/survey/evidence.js';
import { html, patchList, render, setText } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { chainage, plusMinus, withSign } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { jointsText } from '../readout/interval-detail.js';

/**
 * @typedef {object} Row a joint, a mark of a person that is none, or a joint that is left out
 * @property {string} key
 * @property {number} frame
 * @property {Record<string, any>|null} joint of the result of the corrections
 * @property {boolean} [isMark]
 * @property {Record<string, any>} [same] the joint that the mark belongs to
 * @property {Record<string, any>} [off] where the mark is, if it does not count
 */

export class JointsSection extends Component {
  /** The joints seen last: with too few of them there is no result, but a person must see them to put them back. */
  #seen = [];

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'corrections/joints-section'>} */
    this.parts = render(
      this,
      html`<h3>${t('corrections.joints')}</h3>
        <label class="switch row"><input type="checkbox" data-part="use" /><span data-part="useText"></span></label>
        <p class="help" role="status" data-part="done"></p>
        <div class="fix__buttons row wrap">
          <button class="button button--small" data-part="mark" aria-pressed="false">${icon('plus')}${t('corrections.mark_joint')}</button>
        </div>
        <p class="help" data-part="marking" hidden>${t('corrections.marking')}</p>
        <table class="joints tally number" data-part="table" hidden>
          <caption class="visually-hidden">${t('corrections.joints')}</caption>
          <thead><tr><th scope="col">${t('corrections.joint_no')}</th><th scope="col">${t('corrections.distance')}</th>
            <th scope="col">${t('corrections.residual')}</th><th scope="col">${t('corrections.seen_in')}</th>
            <td></td></tr></thead>
          <tbody data-part="rows"></tbody>
        </table>`,
    );
    const { parts, desk } = this;
    // Null states nothing: the server then uses the joints wherever it can count them.
    this.listen(parts.use, 'change', () => this.#edit({ use: parts.use.checked ? null : false }));
    this.listen(parts.mark, 'click', () => this.#togglePicking());
    this.listen(desk.picking, 'change', () => this.#showPicking());
    this.listen([desk.corrections.draft, desk.corrections.preview, desk.inspection], 'change', () => this.#show());
    this.signal.addEventListener('abort', () => desk.picking.set(null));
    this.#show();
  }

  get #joints() {
    return this.desk.corrections.draft.value.joints;
  }

  #edit(changes) {
    this.desk.corrections.edit({ joints: { ...this.#joints, ...changes } });
  }

  /** While it is on, a click on the picture marks a joint. */
  #togglePicking() {
    const { picking } = this.desk;
    picking.set(picking.value === this.#mark ? null : this.#mark);
  }

  #mark = ({ frame, pixel }) => {
    const rounded = pixel.map((coordinate) => Math.round(coordinate * 10) / 10);
    this.#edit({ use: true, marked: [...this.#joints.marked, { frame, pixel: rounded }] });
  };

  #showPicking() {
    const isOn = this.desk.picking.value === this.#mark; // measuring takes clicks too
    this.parts.mark.setAttribute('aria-pressed', String(isOn));
    this.parts.marking.hidden = !isOn;
  }

  #show() {
    const { parts, desk } = this;
    const length = desk.inspection.value.rig.pipe.segment_length_mm;
    const { use, marked, left_out: leftOut } = this.#joints;
    parts.use.checked = use !== false;
    parts.use.disabled = parts.mark.disabled = !length;
    parts.useText.textContent = length
      ? t('corrections.use_joints', { length: chainage(length / 1000) })
      : t('corrections.no_segment');
    // The last known state stays until a new preview arrives.
    const { preview } = desk.corrections;
    if (preview.value === null) return;
    setText(parts.done, doneText(preview.value.result, use));
    if (preview.value.result?.joints.length) this.#seen = preview.value.result.joints;
    const counts = this.#seen.filter((joint) => !leftOut.some(({ frame }) => frame === joint.frame));
    /** @type {Row[]} */
    const rows = [
      ...counts.map((joint, i) => ({ key: `joint-${i}-${joint.frame}`, joint, frame: joint.frame })),
      ...marked
        .filter(({ frame }) => !counts.some((joint) => joint.is_marked && joint.frame === frame))
        .map(({ frame }) => ({
          key: `mark-${frame}`,
          joint: null,
          frame,
          isMark: true,
          same: counts.find(({ other_frames: others }) => others.includes(frame)),
          off: preview.value.result?.uncounted_marks.find((mark) => mark.frame === frame),
        })),
      ...leftOut.map(({ frame }) => ({ key: `out-${frame}`, joint: null, frame })),
    ].sort((a, b) => a.frame - b.frame);
    parts.table.hidden = rows.length === 0;
    patchList(
      parts.rows,
      rows,
      ({ key }) => key,
      (row) => this.#createRow(row),
      updateRow,
    );
  }

  #createRow({ joint, frame, isMark = joint?.is_marked }) {
    const row = document.createElement('tr');
    const isOut = joint === null && !isMark;
    row.classList.toggle('joints__out', joint === null);
    row.parts = render(
      row,
      html`<th scope="row" data-part="number"></th><td data-part="distance"></td><td data-part="residual"></td>
        <td><button class="link" data-part="go">${t('corrections.frame', { frame })}</button></td>
        <td><button class="button button--quiet button--small" data-part="toggle">${
          isOut ? t('corrections.put_back') : t('corrections.leave_out')
        }</button></td>`,
    );
    row.parts.toggle.setAttribute(
      'aria-label',
      isOut ? t('corrections.put_back_of', { frame }) : t('corrections.leave_out_of', { frame }),
    );
    row.parts.go.addEventListener('click', () => this.desk.seek(frame));
    row.parts.toggle.addEventListener('click', () => {
      if (isOut) this.#edit({ left_out: this.#joints.left_out.filter((other) => other.frame !== frame) });
      else if (isMark) this.#edit({ marked: this.#joints.marked.filter((other) => other.frame !== frame) });
      else this.#edit({ left_out: [...this.#joints.left_out, { frame }] });
    });
    return row;
  }
}

/** @param {HTMLElement} element @param {Row} row */
function updateRow({ parts }, { joint, isMark, same, off }) {
  parts.number.textContent = (joint ?? same)?.number ?? '–';
  parts.distance.textContent = joint
    ? `${chainage(joint.distance_m)} ${plusMinus(joint.u95_m)}`
    : isMark
      ? markText(same, off)
      : t('corrections.is_left_out');
  const left = joint?.residual_mm ?? null;
  parts.residual.textContent = left === null ? '' : `${withSign(left, 1)} mm`;
  if (joint?.is_marked) parts.number.title = t('corrections.marked_by_hand');
}

/** Describes a click that is no separate joint. */
function markText(same, off) {
  if (same) return t('corrections.is_same_joint');
  return off ? t('corrections.is_off', { where: chainage(off.distance_m) }) : t('corrections.is_not_counted');
}

/** Describes what the joints changed, or why they changed nothing. */
function doneText(result, use) {
  if (result?.by_joints) return jointsText(result.by_joints);
  if (result?.joints_refusal) {
    const detail = refusalText(result.joints_reason) ?? result.joints_refusal;
    return t('corrections.joints_refused', { detail });
  }
  return use === false || !result ? '' : t('corrections.joints_none');
}

customElements.define('joints-section', JointsSection);
