/** The end of a survey: how it ended, the closure, open stretches and issues; for live runs and past ones. */

import { refusalIn } from '../../../core/server/api.js';
import { SIGMA_MM, knownLength, withKnownLength } from '../../../core/survey/corrections.js';
import { isFinished } from '../../../core/survey/inspection.js';
import { html, render, renderNew } from '../../../core/page/html.js';
import { stretchesOf } from '../../../core/defects/stretches.js';
import { chainage } from '../../../core/wall/units.js';
import { errorText, t } from '../../../core/page/words.js';
import { confirmEnd, proposedEnds } from '../actions/ends.js';
import { sentenceOf } from '../panels/sentences.js';
import { metresField, isPositive, readMetres, writeMetres } from '../../distance/corrections/fields.js';
import { closureMarkup, isClosed } from '../../distance/corrections/known-length.js';
import { openDialog, orFault } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';

/** Reasons, with their letters after BDC: an object, water, the equipment; the rest is another reason. */
const REASONS = {
  [t('finish.obstruction')]: 'A',
  [t('finish.water')]: 'B',
  [t('finish.collapse')]: 'Z',
  [t('finish.traction')]: 'C',
  [t('finish.lighting')]: 'C',
};
/** Number of checks shown here; the others are in their tab. */
const SHOWN = 5;

/**
 * @param {Desk} desk
 * @returns {Promise<string>} 'finished', 'reopened', '' when it was dismissed
 */
export async function openFinish(desk) {
  const { inspection } = desk;
  const hasEnded = isFinished(inspection.value);
  const { dialog, parts, closed } = openDialog({
    title: t('finish.title'),
    content: hasEnded ? endedMarkup(inspection.value) : formMarkup(desk),
  });
  if (hasEnded) {
    parts.reopen.addEventListener('click', () =>
      orFault(parts, async () => {
        await inspection.reopen();
        dialog.close('reopened');
      }),
    );
    return closed;
  }
  const end = new AbortController();
  dialog.addEventListener('close', () => end.abort());
  new FinishForm(desk, dialog, parts, end.signal);
  return closed;
}

class FinishForm {
  #desk;
  #dialog;
  #parts;
  #signal;
  #asking = null;
  /** Start and end that are proposed, and what the person has chosen for them, by code. */
  #ends = [];
  #chosen = new Map();

  constructor(desk, dialog, parts, signal) {
    this.#desk = desk;
    this.#dialog = dialog;
    this.#parts = parts;
    this.#signal = signal;
    const { header } = desk.inspection.value;
    writeMetres(parts.known, header.known_length_m ?? knownLength(desk.corrections.draft.value)?.length_m ?? null);
    const on = (target, type, run) => target.addEventListener(type, run, { signal });
    on(parts.how, 'change', () => this.#showHow());
    on(parts.known, 'change', () => this.#showClosure());
    on(parts.reasons, 'click', ({ target }) => {
      const reason = target.closest('[data-reason]');
      if (!reason) return;
      parts.reason.value = reason.textContent;
      parts.reason.focus();
      this.#showEnds();
    });
    on(parts.reason, 'change', () => this.#showEnds());
    on(parts.endRows, 'change', ({ target }) => this.#chooseEnd(target));
    on(parts.stretches, 'click', ({ target }) => {
      const button = target.closest('[data-start]');
      if (button) this.#finishHere(button.dataset.start);
    });
    on(desk.observations, 'change', () => this.#showStretches());
    on(desk.playhead, 'change', () => this.#showStretches());
    on(desk.checks, 'change', () => [this.#showEnds(), this.#showChecks()]);
    on(parts.form, 'submit', (event) => {
      event.preventDefault();
      this.#submit();
    });
    this.#showHow();
    this.#showStretches();
    this.#showChecks();
    this.#showClosure();
    desk.checks.loadSoon();
  }

  get #end() {
    return this.#dialog.querySelector('[name="end"]:checked')?.value ?? null;
  }

  get #known() {
    return readMetres(this.#parts, 'known', isPositive, t('corrections.fault_positive'));
  }

  /** The length says that the far end was reached; the person sees it chosen, and may choose otherwise. */
  #proposeComplete() {
    this.#dialog.querySelector('[name="end"][value="complete"]').checked = true;
    this.#showHow();
  }

  #showHow() {
    this.#parts.why.hidden = this.#end !== 'abandoned';
    this.#parts.howFault.textContent = '';
    this.#showEnds();
  }

  /** Shows the start and the end that nobody has coded; what the person has chosen for a code stays. */
  #showEnds() {
    const { ends, endRows, reason } = this.#parts;
    const why = reason.value.trim();
    const letter = why ? (REASONS[why] ?? 'Z') : null;
    this.#ends = proposedEnds(this.#desk, { isEnding: true, isAbandoned: this.#end === 'abandoned' }).map((end) => {
      const likely = end.char1 ?? (end.kinds.some(({ value }) => value === letter) ? letter : null);
      return { ...end, char1: likely, ...this.#chosen.get(end.code) };
    });
    ends.hidden = this.#ends.length === 0;
    renderNew(endRows, html`${this.#ends.map(endMarkup)}`);
  }

  /** Notes what the person chooses for a start or an end. */
  #chooseEnd(input) {
    const { code } = input.closest('[data-code]').dataset;
    const choice = input.type === 'checkbox' ? { isOff: !input.checked } : { char1: input.value || null };
    this.#chosen.set(code, { ...this.#chosen.get(code), ...choice });
    Object.assign(
      this.#ends.find((end) => end.code === code),
      choice,
    );
  }

  /** Shows the closure from the zero, or the first frame, to the present end of the run. */
  async #showClosure() {
    const { corrections, track, inspection } = this.#desk;
    const known = this.#known;
    this.#asking?.abort();
    if (!known || track.length === 0 || corrections.value === null) {
      render(this.#parts.closure, html``);
      return;
    }
    this.#asking = new AbortController();
    const { stated } = corrections.value;
    const length = {
      first_frame: stated.zero?.frame ?? 0,
      last_frame: track.length - 1,
      sigma_mm: SIGMA_MM[inspection.value.header.known_length_source] ?? SIGMA_MM.drawing,
      ...knownLength(stated),
      length_m: known,
    };
    const show = (/** @type {any} */ { result = null, error = null }) => {
      render(
        this.#parts.closure,
        result?.closure ? closureMarkup(result.closure) : html`<p class="help">${error && errorText(error)}</p>`,
      );
      if (result?.closure && isClosed(result.closure) && this.#end === null) this.#proposeComplete();
    };
    try {
      show(
        await corrections.ask(withKnownLength(stated, length), AbortSignal.any([this.#signal, this.#asking.signal])),
      );
    } catch (error) {
      const refusal = refusalIn(error);
      if (refusal) show({ error: refusal });
    }
  }

  #showStretches() {
    const { observations, playhead, catalogue } = this.#desk;
    const { row } = playhead.value;
    const open = stretchesOf(observations.value, 0).filter(({ isOpen }) => isOpen);
    this.#parts.open.hidden = open.length === 0;
    const here = row ? chainage(row.distance_mm / 1000) : '';
    const focused = document.activeElement?.dataset?.start;
    renderNew(
      this.#parts.stretches,
      html`${open.map(({ number, start }) => {
        const stretch = `A${number}`;
        const name = start.code
          ? `${stretch} ${start.code} ${catalogue.label(start.code, start.char1, start.char2)}`
          : stretch;
        return html`<li class="finish__open row wrap apart pad-row"><span class="number">${t('finish.stretch_since', { name, where: chainage(start.distance_m) })}</span>
          <button type="button" class="button button--small" data-start="${start.id}"
          aria-label="${t('finish.finish_at', { stretch, where: here })}">${t('finish.finish_here')}
          ${here && html`<span class="dim number">${here}</span>`}</button></li>`;
      })}`,
    );
    if (focused) this.#parts.stretches.querySelector(`[data-start="${focused}"]`)?.focus();
  }

  /** Finishes a stretch at the middle of the picture at the play head, with the stretch's code. */
  #finishHere(id) {
    const start = this.#desk.observations.find(id);
    if (!start) return;
    const { code, char1, char2, continuous } = start;
    this.#desk.tagCentre({ code, char1, char2, continuous: `B${continuous.slice(1)}` });
  }

  #showChecks() {
    const { checks, observations } = this.#desk;
    // Open stretches are listed separately above.
    // So are start and end.
    const blocking = (checks.value ?? [])
      .filter((issue) => !this.#ends.some((end) => end.issue === issue.code))
      .filter(({ level, code }) => level === 'block' && code !== 'open_stretch' && code !== 'abandoned_without_reason')
      .filter(({ params }) => params.field !== 'end_condition');
    this.#parts.missing.hidden = blocking.length === 0;
    render(
      this.#parts.blocking,
      html`${blocking.slice(0, SHOWN).map((issue) => html`<li>${sentenceOf(issue, issue.observation_id && observations.find(issue.observation_id))}</li>`)}
        ${blocking.length > SHOWN && html`<li class="dim">${t('finish.and_more', { n: blocking.length - SHOWN })}</li>`}`,
    );
  }

  async #submit() {
    const parts = this.#parts;
    const [end, known] = [this.#end, this.#known];
    const reason = parts.reason.value.trim();
    parts.howFault.textContent = end ? '' : t('finish.choose_end');
    const isReasonMissing = end === 'abandoned' && !reason;
    parts.reasonFault.textContent = isReasonMissing ? t('finish.reason_needed') : '';
    parts.reason.setAttribute('aria-invalid', String(isReasonMissing));
    if (!end) this.#dialog.querySelector('[name="end"]').focus();
    else if (isReasonMissing) parts.reason.focus();
    if (!end || isReasonMissing || known === undefined) return;
    const ends = this.#ends.filter(({ isOff }) => !isOff);
    await orFault(parts, async () => {
      // The server counts the stretches: the last tags must have arrived.
      await this.#desk.whenSent(this.#signal);
      await this.#desk.inspection.finish({
        end_condition: end,
        ...(end === 'abandoned' && { abandon_reason: reason }),
        ...(known !== null && { known_length_m: known }),
      });
      for (const each of ends)
        confirmEnd(this.#desk, each, end === 'abandoned' && each.issue === 'no_finish' ? reason : '');
      this.#dialog.close('finished');
    });
  }
}

const endedMarkup = ({ header }) => html`<p>${
  header.end_condition === 'abandoned'
    ? t('finish.is_abandoned', { reason: header.abandon_reason ?? '–' })
    : t('finish.is_complete')
}</p>
  <div data-part="fault" role="alert"></div>
  <div class="dialog__buttons"><button class="button" data-part="reopen">${icon('undo')}${t('finish.reopen')}</button></div>`;

const formMarkup = ({ inspection }) => html`<form class="stack gap-4" data-part="form" novalidate>
  <fieldset class="finish__how stack halves" data-part="how">
    <legend class="below-2">${t('finish.how')}</legend>
    ${
      /** @type {const} */ ([
        ['complete', t('finish.complete'), 'check'],
        ['abandoned', t('finish.abandoned'), 'stop'],
      ]).map(
        ([value, label, sign]) =>
          html`<label class="finish__choice tile row pad-row holds">${icon(sign)}<input type="radio" name="end" value="${value}" />${label}</label>`,
      )
    }
    <span class="fault whole-row" data-part="howFault" role="alert"></span>
  </fieldset>
  <div class="field" data-part="why" hidden>
    <label for="finish-reason">${t('finish.reason')}</label>
    <div class="row wrap" data-part="reasons">${Object.keys(REASONS).map(
      (reason) => html`<button type="button" class="button button--small"
      data-reason>${reason}</button>`,
    )}</div>
    <textarea class="input" id="finish-reason" rows="2" maxlength="2000" aria-describedby="finish-reason-fault" data-part="reason"></textarea>
    <span class="fault" id="finish-reason-fault" data-part="reasonFault"></span>
  </div>
  <div class="stack">
    ${metresField({ part: 'known', id: 'finish-known', label: t('finish.known'), help: t('finish.known_help') })}
    <div data-part="closure" role="status"></div>
  </div>
  <section class="stack" data-part="ends" hidden>
    <h3>${t('ends.title')}</h3><p class="help">${t('ends.help')}</p>
    <ul class="stack gap-row" data-part="endRows"></ul>
  </section>
  <section class="stack" data-part="open" hidden>
    <h3>${t('finish.stretches')}</h3><p class="help">${t('finish.stretches_help')}</p>
    <ul class="stack" data-part="stretches"></ul>
  </section>
  <section class="stack" data-part="missing" hidden>
    <h3>${t('finish.blocking')}</h3><p class="help">${t('finish.blocking_help')}</p>
    <ul class="finish__missing" data-part="blocking"></ul>
  </section>
  <div data-part="fault" role="alert"></div>
  <div class="dialog__buttons">
    ${isRunning(inspection) && html`<p class="help finish__live">${t('finish.live_help')}</p>`}
    <button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
    <button class="button button--primary" data-part="submit">${isRunning(inspection) ? t('finish.submit_live') : t('finish.submit')}</button>
  </div></form>`;

/** A proposal: whether it is added, where, and its kind. */
const endMarkup = ({
  code,
  char1,
  distance_m: at,
  kinds,
  isOff,
}) => html`<li class="finish__end row wrap" data-code="${code}">
  <label class="row"><input type="checkbox" ${!isOff && html`checked`} /><b>${code}</b>
    <span class="number nowrap">${chainage(at)}</span></label>
  ${
    kinds.length > 0 &&
    html`<select class="input grow" aria-label="${t('ends.kind', { code })}">
    <option value="">${t('ends.kind_none')}</option>
    ${kinds.map(({ value, label }) => html`<option value="${value}" ${value === char1 && html`selected`}>${value} ${label}</option>`)}</select>`
  }</li>`;

const isRunning = ({ value, isUnfinished }) => value.source.kind === 'live' && isUnfinished;
