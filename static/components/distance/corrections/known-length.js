/** The known length of the asset, from the zero to the far end, with its closure before it is used. */

import { SIGMA_MM, knownLength, withKnownLength } from '../../../core/survey/corrections.js';
import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { chainage, lengthUnit, signed, toShown, withSign } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { isPositive, metresField, numberField, read, readMetres, write, writeMetres } from './fields.js';
import { bindEnds, endsMarkup, showEnds } from './length-ends.js';

const SOURCES = {
  drawing: t('corrections.source_drawing'),
  survey: t('corrections.source_survey'),
  tape: t('corrections.source_tape'),
};
/** Standard deviations within which chance explains a residual; the server refuses larger ones. */
const LIMIT = 3;

export class KnownLength extends Component {
  /** What was typed before there is a length. */
  #begun = { first_frame: null, last_frame: null, sigma_mm: SIGMA_MM.drawing };

  mount() {
    this.desk = this.closest('inspection-page').desk;
    /** @type {Parts<'corrections/known-length'>} */
    this.parts = render(
      this,
      html`<h3>${t('corrections.known')}</h3>
        <p class="help">${t('corrections.known_help')}</p>
        <div class="fix__row stack gap-3 halves">
          ${metresField({ part: 'length', id: 'known-length', label: t('corrections.length') })}
          ${numberField({ part: 'sigma', id: 'known-sigma', label: t('corrections.sigma'), unit: 'mm' })}
          <div class="field"><span class="label" id="known-source">${t('corrections.source')}</span>
            <div class="row wrap" role="group" aria-labelledby="known-source">
              ${Object.entries(SOURCES).map(([name, label]) => html`<button class="button button--small" data-source="${name}">${label}</button>`)}
            </div></div>
        </div>
        ${endsMarkup()}
        <div class="fix__buttons row wrap">
          <button class="button button--small" data-part="fromHeader" hidden></button>
          <button class="button button--small button--quiet" data-part="clear" hidden>${t('corrections.remove')}</button>
        </div>
        <div data-part="closure" role="status"></div>`,
    );
    const { parts, desk } = this;
    for (const button of this.querySelectorAll('[data-source]')) {
      this.listen(button, 'click', () => this.#change({ sigma_mm: SIGMA_MM[button.dataset.source] }));
    }
    this.listen(parts.length, 'change', () => this.#typedLength());
    this.listen(parts.sigma, 'change', () => this.#typedSigma());
    this.listen(parts.clear, 'click', () => this.#remove());
    this.listen(parts.fromHeader, 'click', () => this.#change({ length_m: this.#stated.known_length_m }));
    bindEnds(parts, desk, this.signal, (ends) => this.#change(ends));
    this.listen(desk.corrections.draft, 'change', () => this.#show());
    this.listen(desk.corrections.preview, 'change', () => this.#showClosure());
    this.listen([desk.inspection, desk.track], 'change', () => this.#show());
    this.#show();
    this.#showClosure();
  }

  /** The header, in which a known length may be stated. */
  get #stated() {
    return this.desk.inspection.value.header;
  }

  /** The length of the draft, possibly incomplete. */
  get #length() {
    const { draft } = this.desk.corrections;
    const known = knownLength(draft.value) ?? { ...this.#begun, length_m: null };
    return {
      ...known,
      first_frame: known.first_frame ?? draft.value.zero?.frame ?? 0,
      last_frame: known.last_frame ?? Math.max(0, this.desk.track.length - 1),
    };
  }

  #typedLength() {
    const metres = readMetres(this.parts, 'length', isPositive, t('corrections.fault_positive'));
    if (metres === null) this.#remove();
    else if (metres !== undefined) this.#change({ length_m: metres });
  }

  #typedSigma() {
    const sigma = read(this.parts, 'sigma', isPositive, t('corrections.fault_positive'));
    if (sigma) this.#change({ sigma_mm: sigma });
  }

  #change(changes) {
    const length = { ...this.#length, ...changes };
    if (length.length_m === null) {
      this.#begun = { ...this.#begun, ...changes };
      this.#show();
      return;
    }
    const { corrections } = this.desk;
    corrections.edit(withKnownLength(corrections.draft.value, length));
  }

  #remove() {
    const { corrections } = this.desk;
    corrections.edit({ ...withKnownLength(corrections.draft.value, null), forced: null });
  }

  #show() {
    const { parts, desk } = this;
    const length = this.#length;
    const isStated = knownLength(desk.corrections.draft.value) !== undefined;
    const { known_length_m: statedM } = this.#stated;
    writeMetres(parts.length, length.length_m);
    write(parts.sigma, length.sigma_mm);
    for (const button of this.querySelectorAll('[data-source]')) {
      button.setAttribute('aria-pressed', String(SIGMA_MM[button.dataset.source] === length.sigma_mm));
    }
    showEnds(parts, desk, length);
    parts.clear.hidden = !isStated;
    parts.fromHeader.hidden = typeof statedM !== 'number' || length.length_m === statedM;
    parts.fromHeader.textContent = parts.fromHeader.hidden
      ? ''
      : t('corrections.from_header', { length: `${signed(toShown(statedM), 2)} ${lengthUnit}` });
  }

  #showClosure() {
    const { preview } = this.desk.corrections;
    const closure = preview.value?.result?.closure;
    render(this.parts.closure, closure ? closureMarkup(closure) : html``);
  }
}

/** Whether chance explains what is left at the far end. */
export const isClosed = ({ residual_mm, sigma_mm }) => Math.abs(residual_mm) <= LIMIT * sigma_mm;

/** Shows measured and known length, their difference, and whether chance explains it. */
export function closureMarkup({ known_length_m, measured_m, residual_mm, residual_percent, sigma_mm }) {
  const limit = LIMIT * sigma_mm;
  const fits = isClosed({ residual_mm, sigma_mm });
  return html`<div class="closure message ${fits ? 'closure--fits sign-ok' : 'message--error'}">${icon(fits ? 'check' : 'alert')}
    <div>
      <p class="closure__residual number"><b>${withSign(residual_mm, 0)} mm</b> <span>(${withSign(residual_percent, 2)} %)</span></p>
      <p class="number">${t('corrections.closure', { measured: chainage(measured_m), known: chainage(known_length_m) })}</p>
      <p class="dim number">${
        fits
          ? t('corrections.closure_fits', { limit: limit.toFixed(0) })
          : t('corrections.closure_refused', { limit: limit.toFixed(0) })
      }</p>
    </div></div>`;
}

customElements.define('known-length', KnownLength);
