/** The counter burnt into the film: its state, its faults, and its length as an offer for the scale. */

import { knownLength, withKnownLength } from '../../../core/survey/corrections.js';
import { SOURCES } from '../../../core/survey/track.js';
import { hasFilm } from '../../../core/survey/inspection.js';
import { html, render, renderNew } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { chainage, lengthUnit, plusMinus, signed } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { askForBox } from './box-dialog.js';
import { numberField, read, write } from './fields.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const UNITS = { m: 1, ft: 0.3048 };
/** Uncertainty of a counter's way, one sigma. */
const USUAL_PERCENT = 0.5;
const MOST_PERCENT = 20;
const CARRYING = new Set(['counter', 'bridged']);
const LENGTH_FIELDS = ['first_frame', 'last_frame', 'length_m', 'sigma_mm'];

export class CounterSection extends Component {
  mount() {
    this.page = this.closest('inspection-page');
    this.desk = this.page.desk;
    this.hidden = !hasFilm(this.desk.inspection.value);
    if (this.hidden) return;
    /** @type {Parts<'corrections/counter-section'>} */
    this.parts = render(
      this,
      html`<h3>${t('counter.title')}</h3>
        <div class="stack" data-part="state" role="status"></div>
        <div data-part="offer"></div>
        <div data-part="faults"></div>
        <div data-part="trust" hidden>${numberField({ part: 'percent', id: 'counter-percent', label: t('counter.percent'), unit: '%', help: t('counter.percent_help') })}</div>
        <div class="fix__buttons row wrap" data-part="buttons">
          ${button('cancel', 'stop', t('counter.cancel'))}
          ${button('read', 'retry', '')}
          ${button('draw', 'edit', t('counter.draw'))}
          ${button('none', 'close', t('counter.none'))}
        </div>`,
    );
    const { desk, parts } = this;
    this.listen(parts.cancel, 'click', () => orToast(() => desk.counter.cancel()));
    this.listen(parts.read, 'click', () => this.#state(desk.counter.stated));
    this.listen(parts.none, 'click', () => this.#state({ is_present: false }));
    this.listen(parts.draw, 'click', async () => {
      const box = await askForBox(desk);
      if (box) this.#state({ ...desk.counter.stated, box });
    });
    this.listen(parts.percent, 'change', () => {
      const percent = read(
        parts,
        'percent',
        (number) => number > 0 && number <= MOST_PERCENT,
        t('counter.percent_fault'),
      );
      if (percent !== undefined) this.#state({ ...desk.counter.stated, percent });
    });
    this.listen(this, 'click', ({ target }) => this.#clicked(target.closest('button')?.dataset ?? {}));
    this.listen([desk.counter, desk.inspection, desk.corrections, desk.track], 'change', () => this.#show());
    this.#show();
  }

  /** Handles the buttons that come and go with what is known. */
  #clicked({ unit, frame, use }) {
    if (unit) this.#state({ ...this.desk.counter.stated, unit });
    if (frame) this.desk.seek(Number(frame));
    if (use !== undefined) this.#use(this.desk.counter.value);
  }

  #state(stated) {
    return orToast(async () => {
      await this.desk.counter.state(stated);
      this.page.followCounter();
    });
  }

  #show() {
    const counter = this.desk.counter.value;
    this.parts.buttons.hidden = counter === null;
    if (!counter) return;
    const { parts } = this;
    const { state, comparison } = counter;
    const isWaiting = state === 'waiting';
    parts.cancel.hidden = !isWaiting;
    parts.read.hidden = isWaiting || state === 'declined';
    parts.read.querySelector('span').textContent = state === 'unread' ? t('counter.read') : t('counter.again');
    parts.draw.hidden = isWaiting || this.desk.track.length === 0;
    parts.none.hidden = isWaiting || state === 'declined';
    parts.trust.hidden = state !== 'read';
    write(parts.percent, counter.percent ?? USUAL_PERCENT);
    const sources = this.desk.track.column('source');
    const carried = sources.filter((source) => CARRYING.has(SOURCES[source])).length;
    const share = carried ? Math.round((100 * carried) / sources.length) : 0;
    renderNew(parts.state, stateMarkup(counter, this.desk.inspection.isUnfinished, share));
    renderNew(parts.offer, this.#offer(counter));
    renderNew(parts.faults, comparison ? faultsMarkup(comparison.faults, this.desk.track) : html``);
  }

  #offer({ comparison, unit }) {
    const length = comparison?.length;
    if (!length) return html``;
    const known = this.desk.corrections.value && knownLength(this.desk.corrections.value.stated);
    const isUsed = known !== undefined && isSame(known, length);
    const text = t('counter.says', {
      counter: bothUnits(length.length_m, unit),
      camera: `${chainage(length.camera_m)} ${plusMinus(length.camera_u95_m)}`,
      scale: length.scale.toFixed(3),
      sigma: length.scale_sigma.toFixed(3),
    });
    return html`<div class="message ${length.agrees ? 'sign-ok' : 'message--warning'}">${icon(length.agrees ? 'check' : 'alert')}
      <div class="stack gap-1 at-start"><p class="number">${text}</p>
        <p class="dim">${length.agrees ? t('counter.agrees') : t('counter.disagrees')}
          ${t('counter.between', { first: length.first_frame, last: length.last_frame })}</p>
        ${
          isUsed
            ? html`<p><b>${t('counter.is_used')}</b></p>`
            : html`<button type="button" class="button button--small" data-use>${icon('check')}${
                known ? t('counter.use_instead') : t('counter.use')
              }</button>`
        }
      </div></div>`;
  }

  /** Applies the counter's length as the known one; what the track contradicts waits as a draft, with its closure. */
  #use({ comparison: { length } }) {
    return orToast(async () => {
      const { corrections } = this.desk;
      const isAlone = !corrections.isEdited;
      const { first_frame, last_frame, length_m, sigma_mm } = length;
      const stated = withKnownLength(corrections.draft.value, { first_frame, last_frame, length_m, sigma_mm });
      const isAccepted = isAlone && (await corrections.ask(stated)).error === null;
      if (isAccepted) await this.page.correct(stated, t('counter.remark'), { text: t('counter.used') });
      else corrections.edit({ lengths: stated.lengths });
    });
  }
}

const isSame = (known, length) => LENGTH_FIELDS.every((name) => known[name] === length[name]);

/** '15.09 m (49.5 ft)' where the counter counts in another unit than the person. */
function bothUnits(m, unit) {
  if (unit === lengthUnit) return chainage(m);
  return `${chainage(m)} (${signed(m / UNITS[unit], unit === 'ft' ? 1 : 2)} ${unit})`;
}

function stateMarkup(counter, isUnfinished, carriedPercent) {
  const { state, progress, detail, unit } = counter;
  if (state === 'waiting') return waitingMarkup(progress, isUnfinished);
  if (state !== 'read') {
    const isBad = state === 'failed';
    return html`<p class="${isBad ? 'message message--error' : 'help'}">${isBad && icon('alert')}<span>${wordFor('counter_state', state)}
      ${isBad && detail}</span></p>`;
  }
  const share = t('counter.legible', { legible: counter.legible, frames: counter.frames });
  if (unit === null) {
    return html`<p>${share} ${t('counter.which_unit')}</p><div class="row wrap">${Object.keys(UNITS).map(
      (name) => html`<button type="button" class="button button--small" data-unit="${name}">${name}</button>`,
    )}</div>`;
  }
  const range = t('counter.from_to', { from: chainage(counter.first_m), to: chainage(counter.last_m) });
  return html`<p class="number">${range} <span class="dim">${share}</span></p>
    ${detail && html`<p class="help">${detail}</p>`}
    ${carriedPercent > 0 && html`<p><b>${t('issue.counter_carries', { percent: carriedPercent })}</b></p>`}
    ${!carriedPercent && counter.comparison && !counter.comparison.length && html`<p class="help">${t('counter.too_short')}</p>`}`;
}

function waitingMarkup(progress, isUnfinished) {
  if (!progress) return html`<p class="help">${isUnfinished ? t('counter.after_tracking') : t('counter.waits')}</p>`;
  const { frames_done: done, frames_total: total } = progress;
  if (!done)
    return html`<p>${t('counter.searching')}</p><progress class="bar" aria-label="${t('counter.searching')}"></progress>`;
  const percent = total ? Math.min(Math.floor((100 * done) / total), 100) : null;
  return html`<p class="number">${percent === null ? t('counter.reading_frame', { frame: done }) : t('counter.reading', { percent })}</p>
    <progress class="bar" max="100" ${percent !== null && html`value="${percent}"`} aria-label="${t('counter.title')}"></progress>`;
}

function faultsMarkup(faults, track) {
  if (faults.length === 0) return html``;
  const where = (frame) => {
    const row = track.row(frame);
    return row ? chainage(row.distance_mm / 1000) : t('corrections.frame', { frame });
  };
  return html`<table class="joints tally film-counter__faults number">
      <caption class="film-counter__caption small strong">${t('counter.faults')}</caption>
      <thead><tr><th scope="col">${t('counter.fault')}</th><th scope="col">${t('counter.at')}</th>
        <th scope="col">${t('counter.counted')}</th><th scope="col">${t('counter.driven')}</th></tr></thead>
      <tbody>${faults.map(
        (fault) => html`<tr><th scope="row">${wordFor('counter_fault', fault.kind)}</th>
        <td><button type="button" class="link" data-frame="${fault.first_frame}">${where(fault.first_frame)}</button></td>
        <td>${chainage(fault.counter_m)}</td><td>${chainage(fault.camera_m)}</td></tr>`,
      )}</tbody>
    </table>`;
}

const button = (part, sign, label) =>
  html`<button type="button" class="button button--small" data-part="${part}" hidden>${icon(sign)}<span>${label}</span></button>`;

customElements.define('counter-section', CounterSection);
