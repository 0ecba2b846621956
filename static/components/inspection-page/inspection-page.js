/** One inspection: watch the tracking, review it, tag it, export the result. */

import { ApiError, poll } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { isUnfinished, mayGoOn } from '../../core/inspection.js';
import { bindKeys, withKey } from '../../core/keys.js';
import { isLocked } from '../../core/review.js';
import { Component } from '../../core/store.js';
import { chainage, date } from '../../core/units.js';
import { defectCount } from '../../core/stretches.js';
import { errorText, t } from '../../core/words.js';
import { nameOf } from '../defect-list/names.js';
import { openExport } from '../export-dialog/export-dialog.js';
import { EMERGENCY, GROUPS, formatOf } from '../export-dialog/formats.js';
import { GRAVEST } from '../severity-mark/severity-mark.js';
import { icon } from '../icon/icon.js';
import { pace } from '../inspection-list/row.js';
import { showKeys } from '../key-help/key-help.js';
import { editLabels, showLabelButton } from '../labels/labels.js';
import { closesElsewhere } from '../menu/menu.js';
import { askEndOfRecording, openRecordOn } from '../run-again/run-again.js';
import { reviewChip, statusChip } from '../status-chip/status-chip.js';
import { orToast, toast, toastError } from '../toast-stack/toast-stack.js';
import { topBar } from '../top-bar/top-bar.js';
import { isFinished, openFinish } from '../finish-dialog/finish-dialog.js';
import { Desk } from './desk.js';
import { VIEWER_KEYS, keyMap } from './key-map.js';
import { followLinks } from './links.js';
import { stepName } from './step-names.js';
import { TABS } from './tabs.js';
import '../conflict-dialog/conflict-notice.js';
import '../desk-splitter/desk-splitter.js';
import '../distance-readout/distance-readout.js';
import '../emergency-banner/emergency-banner.js';
import '../live-bar/live-bar.js';
import './rig-notice.js';
import '../strip-log/strip-log.js';
import '../tab-panels/tab-panels.js';
import '../video-panel/video-panel.js';
import '../viewer-panel/viewer-panel.js';
import '../wall-strip/wall-strip.js';

const TRACK_POLL_S = 0.7;
/** Pause after the last change, after which the list is read for the times without a server. */
const KEPT_AFTER_MS = 5000;

class InspectionPage extends Component {
  /** @type {string} */
  inspectionId;
  /** @type {Desk} read by the parts of the page when they are mounted */
  desk;

  #keys;
  #isKept = true;
  #isFollowing = false;
  #keeping = 0;
  /** Whether the inspection was approved when the page was built. */
  #isLocked = false;

  async mount() {
    document.title = 'Chainage';
    // Without the menu: anything opened in it would vanish when the page is ready.
    render(this, html`<main id="main" class="content" tabindex="-1"><h1>${t('desk.title')}</h1>
      <p role="status">${t('page.loading')}</p></main>`);
    try {
      this.desk = await Desk.open(this.inspectionId, this.signal);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      render(this, html`${topBar(t('desk.title'))}<main id="main" class="content desk-note" tabindex="-1">
        <h1>${t('desk.not_shown')}</h1>
        <p class="message message--error" role="alert">${icon('alert')}<span>${errorText(error)}</span></p>
        <p><a class="button" href="/">${icon('back')}${t('desk.to_list')}</a></p></main>`);
      return;
    }
    this.#build();
  }

  #build() {
    const { desk } = this;
    const { id, name } = desk.inspection.value;
    document.title = `${name} · Chainage`;
    this.parts = render(
      this,
      html`<header class="topbar desk-bar">
          <div class="desk-bar__title">
            <a class="brand" href="/" aria-label="${t('desk.all')}">${icon('back')}${icon('logo')}</a>
            <h1 class="desk-bar__name" title="${name}">${name}</h1>
            <span role="status" data-part="chip"></span>
            <button type="button" class="chip-button" title="${t('tab.review')}" data-part="review"></button>
            <button type="button" class="chip-button label-button" data-part="labels"></button>
            <span class="desk-bar__pace dim number" data-part="pace"></span>
          </div>
          <div class="desk-bar__tools">
            <button class="button button--small" data-part="cancel" data-needs="operator" hidden>${icon('stop')}<span
              class="desk-bar__word">${t('desk.cancel')}</span></button>
            <button class="button button--small" data-part="retry" data-needs="operator" hidden>${icon('retry')}${t('desk.retry')}</button>
            <button class="button button--small" data-part="recordOn" data-needs="operator" title="${t('again.on_title')}" hidden>${icon('live')}<span
              class="desk-bar__word">${t('again.on')}</span></button>
            <p class="desk-bar__lock dim" role="status" data-part="lock" hidden></p>
            <span class="spacer"></span>
            <p class="save number" role="status" data-part="save" data-needs="operator"></p>
            <button class="button button--quiet button--small" data-part="undo" data-needs="operator">${icon('undo')}
              <span class="desk-bar__word">${t('desk.undo')}</span></button>
            <button class="button button--quiet button--small button--icon" data-part="redo" data-needs="operator">${icon('redo')}
              <span class="visually-hidden">${t('desk.redo')}</span></button>
            <button class="button button--quiet button--small desk-bar__keys" data-part="help" title="${withKey(t('desk.keys'), '?')}">${icon('keys')}
              <span class="desk-bar__word">${t('desk.keys')}</span></button>
            <button class="button button--small" data-part="finish" data-needs="operator"></button>
            <details class="menu" data-part="menu">
              <summary class="button button--small button--primary">${icon('download')}${t('desk.export')}</summary>
              ${exportsMarkup(id)}
            </details>
            <person-menu></person-menu>
          </div>
          <progress class="bar desk-bar__progress" max="1" data-part="bar" aria-label="${t('progress.label')}"></progress>
        </header>
        <main id="main" class="desk-main" tabindex="-1">
          <live-bar></live-bar>
          <div class="desk" data-part="all">
            <distance-readout class="desk__readout panel"></distance-readout>
            <video-panel class="desk__video" data-part="video"></video-panel>
            <section class="desk__strip strips panel" aria-label="${t('strip.title')}">
              <strip-log data-part="strip"></strip-log>
              <wall-strip></wall-strip>
            </section>
            <viewer-panel class="desk__viewer panel" data-part="viewer"></viewer-panel>
            <tab-panels class="desk__side panel" data-part="side"></tab-panels>
            <desk-splitter data-of="side"></desk-splitter>
            <desk-splitter data-of="strip"></desk-splitter>
            <desk-splitter data-of="viewer"></desk-splitter>
            <div class="desk__notices">
              <emergency-banner hidden></emergency-banner>
              <conflict-notice hidden></conflict-notice>
              <div class="desk-messages" data-part="messages"></div>
              <rig-notice hidden></rig-notice>
            </div>
          </div>
        </main>
        <p class="visually-hidden" role="status" data-part="announce"></p>`,
    );
    this.#isLocked = isLocked(desk.inspection.value);
    this.video = this.parts.video;
    this.strip = this.parts.strip;
    this.parts.side.fill(TABS, t('tab.label'), desk.tab);
    desk.seek = (frame) => this.video.seek(frame);

    const { parts } = this;
    this.listen(desk.inspection, 'change', () => this.#showState());
    this.listen(desk.inspection, 'change', () => desk.inspection.isUnfinished && this.#follow());
    this.listen(desk.live, 'message', ({ detail }) => orToast(() => this.#lookFor(detail.header.state)));
    for (const box of [desk.outbox, desk.attachmentOutbox]) this.listen(box, 'change', () => this.#showSaving());
    this.listen(desk.conflicts, 'change', () => this.#showSaving());
    // <conflict-notice> asks about overtaken changes of this inspection.
    this.listen(desk.outbox, 'refused', ({ detail: { operation, error } }) => {
      if (!error.isOvertaken || operation.inspection !== id) toastError(error);
      if (error.code === 'inspection_locked') this.#lookAgain();
    });
    this.listen(desk.outbox, 'answered', () => this.#keepCurrent());
    this.listen(desk.attachmentOutbox, 'refused', ({ detail: { error } }) => toastError(error));
    this.listen(desk.observations, 'change', () => this.#showObservations());
    this.listen(desk.history, 'change', () => this.#showHistory());
    this.listen(document, 'visibilitychange', () => !document.hidden && this.#lookAgain());
    this.listen(desk.editing, 'change', () => desk.editing.value && desk.tab.set('defects'));
    this.listen(desk.editing, 'change', () => parts.all.toggleAttribute('data-editing', desk.editing.value));
    this.listen(desk.large, 'change', () => this.#showLarge());
    this.listen(desk, 'fault', ({ detail }) => toast(detail, { kind: 'error' }));
    this.listen(desk, 'done', ({ detail: { text, ...other } }) => this.#showDone(text, other));
    this.listen(desk, 'tagged', ({ detail }) => this.#announceTag(detail));
    this.listen(desk.review, 'change', () => this.#showReview());
    this.listen(parts.review, 'click', () => desk.tab.set('review'));
    this.listen(parts.labels, 'click', () => orToast(() => editLabels(desk.inspection.value, () => desk.inspection.load())));
    this.listen(parts.cancel, 'click', () => orToast(() => this.#cancel()));
    this.listen(parts.recordOn, 'click', () => this.#recordOn());
    this.listen(parts.retry, 'click', () => orToast(() => this.#retry()));
    this.listen(parts.finish, 'click', () => this.finish());
    this.listen(desk.checks, 'change', () => parts.side.note('checks', String(desk.checks.value?.length || '')));
    this.listen(parts.undo, 'click', () => this.undo());
    this.listen(parts.redo, 'click', () => this.redo());
    this.listen(parts.help, 'click', () => this.help());
    closesElsewhere(parts.menu, this.signal);
    this.listen(parts.menu, 'click', ({ target }) => {
      const item = target.closest('[data-export]');
      if (!item) return;
      parts.menu.querySelector('summary').focus(); // the dialog returns the focus to it
      openExport(desk, formatOf(item.dataset.export));
    });

    const groups = keyMap(this);
    this.#keys = groups;
    const bindings = groups.flatMap((group) => group.bindings);
    bindKeys(document, bindings, this.signal);
    bindKeys(parts.viewer.keys, bindings, this.signal, VIEWER_KEYS);
    parts.viewer.bound = bindings.flatMap((binding) => binding.keys).filter((key) => !VIEWER_KEYS.has(key));

    this.#showState();
    this.#showSaving();
    this.#showObservations();
    this.#showHistory();
    followLinks(desk, this.signal);
    desk.observations.load().catch(toastError);
    desk.corrections.load().catch(toastError);
    desk.review.load().catch(toastError);
    if (desk.inspection.isUnfinished) desk.counter.load().catch(toastError);
    this.#follow({ isOpening: true });
  }

  /** Follows another run that somebody has started; a short one may have ended before the page asks. */
  async #lookFor(state) {
    if (!isUnfinished({ status: state }) || this.desk.inspection.isUnfinished) return;
    await this.desk.inspection.load();
    this.#follow();
  }

  /**
   * Fetches the growing track until tracking has ended, then what may have changed with it.
   * @param {{isOpening?: boolean}} [when] while the page opens, it is reading the list of observations anyway
   */
  async #follow({ isOpening = false } = {}) {
    if (this.#isFollowing) return;
    this.#isFollowing = true;
    const { desk } = this;
    let isListOld = !isOpening || desk.inspection.isUnfinished;
    const onError = (error) => {
      const reason = errorText(error);
      this.#showMessages(error.isTemporary ? t('page.trying_again', { reason }) : reason);
    };
    await poll(
      async () => {
        if (desk.inspection.isUnfinished) await desk.inspection.load();
        // Read after the state: a track fetched after the end is complete.
        await desk.track.extend(this.signal);
        await desk.health.extend(this.signal);
        isListOld ||= desk.inspection.isUnfinished;
        if (desk.inspection.isUnfinished) return TRACK_POLL_S;
        if (isListOld) await desk.observations.load();
        return desk.inspection.isUnfinished ? TRACK_POLL_S : null;
      },
      this.signal,
      onError,
    );
    this.#isFollowing = false;
    if (this.signal.aborted) return;
    this.followCounter();
    // The server waits for the acknowledgement of pictures that came during a review.
    desk.live.acknowledge(desk.live.seq);
    this.#showMessages();
  }

  /** Follows the reading of the burnt-in counter, which begins when the tracking has ended. */
  followCounter() {
    const { desk } = this;
    if (!desk.inspection.isUnfinished) desk.counter.follow((error) => this.#showMessages(errorText(error)));
  }

  /** A recording that has ended cannot be repeated, so this asks first. */
  async #cancel() {
    const { inspection } = this.desk;
    if (inspection.value.live === null || (await askEndOfRecording())) await inspection.cancel();
  }

  async #recordOn() {
    if (await openRecordOn(this.desk.inspection)) location.reload(); // the page of a film becomes that of a camera
  }

  async #retry() {
    await this.desk.inspection.retry();
    this.desk.playhead.set({ frame: -1, row: null, isLive: true, capturedMs: null });
    this.desk.track.clear();
    this.desk.health.clear();
    this.#follow();
  }

  // Commands of the keys and buttons ---------------------------------------------------------

  /** Undoes the last step, or the one that a message names. */
  undo(step) {
    return orToast(async () => this.#showStep(await this.desk.history.undo(step)));
  }

  redo() {
    return orToast(async () => this.#showStep(await this.desk.history.redo()));
  }

  /** Shows what was just done, with an undo or an alternative. */
  #showDone(text, other = {}) {
    const step = this.desk.history.last;
    toast(text, { action: t('page.undo'), run: () => this.undo(step), ...other });
  }

  /** Reports what was undone or redone, and selects it; the picture stays where it is. */
  #showStep(outcome) {
    if (!outcome) return;
    const { step, isBack, isDone, insist } = outcome;
    const { desk } = this;
    if (step.item && desk.observations.find(step.item.id)) desk.selection.set(step.item.id);
    const name = stepName(step);
    if (isDone) {
      toast(isBack ? t('desk.undone', { step: name }) : t('desk.redone', { step: name }));
      return;
    }
    toast(isBack ? t('desk.undo_overtaken', { step: name }) : t('desk.redo_overtaken', { step: name }), {
      kind: 'error',
      action: isBack ? t('desk.undo_still') : t('desk.redo_still'),
      run: () => orToast(async () => this.#showStep(await insist())),
    });
  }

  remove(id = this.desk.selection.value) {
    const item = id && this.desk.observations.find(id);
    if (!item) return;
    this.desk.editing.set(false);
    this.desk.observations.remove(id);
    this.#showDone(t('desk.deleted', { name: nameOf(item) }));
  }

  /** Sets the zero at the shown frame, with the camera as far past the zero as before. */
  async setZero() {
    const { corrections, playhead, inspection } = this.desk;
    const { frame, row } = playhead.value;
    if (!row) {
      this.desk.fault(t('desk.not_tracked'));
      return;
    }
    // A page that was just opened may not have loaded the statements yet.
    if (!corrections.value) await orToast(() => corrections.load());
    if (!corrections.value) return;
    const offset = corrections.draft.value.zero?.offset_m ?? inspection.value.header.camera_offset_m ?? 0;
    const zero = { frame, offset_m: offset };
    // Joins other pending changes; alone it is applied at once.
    if (corrections.isEdited) corrections.edit({ zero });
    else await this.correct({ ...corrections.value.stated, zero }, null, { text: t('corrections.zero_set', { frame }) });
  }

  /** Changes the statements about the distances; the message about it offers an undo. */
  async correct(stated, remark, { text = t('corrections.applied'), replaced } = {}) {
    await orToast(async () => {
      if (await this.desk.correct(stated, remark, replaced)) this.#showDone(text);
    });
  }

  async finish() {
    const done = await openFinish(this.desk);
    if (done === 'finished') toast(t('finish.done'));
    if (done === 'reopened') toast(t('finish.reopened'));
  }

  /** Sets the severity of the selected defect. */
  rate(severity) {
    const { value: id } = this.desk.selection;
    if (id) this.desk.observations.edit(id, { severity });
  }

  edit() {
    if (this.desk.selection.value) this.desk.editing.set(true);
  }

  leave() {
    if (this.desk.large.value) this.desk.large.leave();
    else if (this.desk.picking.value) this.desk.picking.set(null);
    else if (this.desk.editing.value) this.desk.editing.set(false);
    else this.desk.selection.set(null);
  }

  help() {
    showKeys(this.#keys);
  }

  #showLarge() {
    const { value } = this.desk.large;
    if (value) this.parts.all.dataset.large = value;
    else delete this.parts.all.dataset.large;
  }

  // What the top bar shows -------------------------------------------------------------------

  #showState() {
    const { parts, desk } = this;
    const { status, progress, labels } = desk.inspection.value;
    showLabelButton(parts.labels, labels);
    if (parts.chip.dataset.status !== status) {
      parts.chip.dataset.status = status;
      render(parts.chip, statusChip(status));
    }
    const isRunning = status === 'running';
    parts.pace.textContent = isRunning ? pace(progress) : '';
    parts.bar.classList.toggle('desk-bar__progress--off', !isRunning);
    parts.bar.value = progress.frames_total ? progress.frames_done / progress.frames_total : 0;
    parts.cancel.hidden = !desk.inspection.isUnfinished;
    parts.recordOn.hidden = !mayGoOn(desk.inspection.value);
    this.#showFinish();
    this.#showReview();
    parts.retry.hidden = status !== 'failed' && status !== 'cancelled';
    this.#showMessages();
  }

  /** Shows the state of the review; what can be changed on the page depends on it, so it begins anew. */
  #showReview() {
    const { parts, desk } = this;
    const { review } = desk.inspection.value;
    if (isLocked(desk.inspection.value) !== this.#isLocked) location.reload();
    parts.side.note('review', String(desk.review.questions.length || ''));
    if (parts.review.dataset.shows === review.state) return;
    parts.review.dataset.shows = review.state;
    parts.review.hidden = review.state === 'draft'; // as in the list, it needs no word
    render(parts.review, html`${review.state !== 'draft' && reviewChip(review.state)}`);
    parts.lock.hidden = !this.#isLocked;
    if (this.#isLocked) parts.lock.textContent = t('reviewing.locked', { who: review.by, when: date(review.at) });
  }

  #showFinish() {
    const ended = isFinished(this.desk.inspection.value);
    this.parts.finish.hidden = this.desk.inspection.value.live !== null; // the live bar has it
    const text = ended ? t('finish.finished') : t('finish.open');
    if (this.parts.finish.dataset.shows === text) return;
    this.parts.finish.dataset.shows = text;
    render(this.parts.finish, html`${icon(ended ? 'check' : 'flag')}<span class="desk-bar__word">${text}</span>`);
    this.parts.finish.setAttribute('aria-label', text);
  }

  #showMessages(trouble = null) {
    const { error, warning } = this.desk.inspection.value;
    const messages = [
      error && ['error', errorText(error)],
      warning && ['warning', warning],
      trouble && ['warning', trouble],
      !this.desk.outbox.isKept && ['warning', t('desk.not_kept')],
    ].filter(Boolean);
    const text = JSON.stringify(messages);
    if (this.parts.messages.dataset.shows === text) return;
    this.parts.messages.dataset.shows = text;
    render(
      this.parts.messages,
      html`${messages.map(([kind, sentence]) => html`<p class="message message--${kind}" role="alert" tabindex="0">
        ${icon('alert')}<span>${sentence}</span></p>`)}`,
    );
  }

  #showSaving() {
    const boxes = [this.desk.outbox, this.desk.attachmentOutbox];
    const count = boxes.reduce((sum, box) => sum + box.count, 0);
    const reason = boxes.map((box) => box.reason).find((found) => found !== null) ?? null;
    const isStuck = reason !== null && count > 0;
    const { length: undecided } = this.desk.conflicts.value;
    const settled = undecided ? t('desk.undecided', { n: undecided }) : t('desk.saved');
    this.parts.save.textContent = count === 0 ? settled : t('desk.waiting', { n: count });
    this.parts.save.title = isStuck ? reason : '';
    this.parts.save.classList.toggle('save--waiting', count + undecided > 0);
    if (this.#isKept === this.desk.outbox.isKept) return;
    this.#isKept = this.desk.outbox.isKept;
    this.#showMessages();
  }

  #showObservations() {
    const { value: observations } = this.desk.observations;
    this.parts.side.note('defects', String(defectCount(observations) || ''));
    this.parts.emergency.hidden = !observations.some(({ severity }) => severity === GRAVEST);
  }

  /** Shows on each button the step that it undoes or redoes. */
  #showHistory() {
    const { parts, desk: { history: { last, next } } } = this;
    for (const [button, step, title, key] of [
      [parts.undo, last, last ? t('desk.undo_step', { step: stepName(last) }) : t('desk.undo_none'), 'U'],
      [parts.redo, next, next ? t('desk.redo_step', { step: stepName(next) }) : t('desk.redo_none'), 'Shift + U'],
    ]) {
      button.disabled = !step;
      button.title = withKey(title, key);
    }
  }

  /** Reads the list again after changes: a browser keeps what was read, and opens it without the server. */
  #keepCurrent() {
    if (!navigator.serviceWorker?.controller) return;
    clearTimeout(this.#keeping);
    this.#keeping = setTimeout(() => this.isConnected && this.#lookAgain(), KEPT_AFTER_MS);
  }

  /** Reads what others have tagged while the page was hidden. */
  #lookAgain() {
    const { observations, review, inspection } = this.desk;
    orToast(() => Promise.all([observations.load(), review.load(), inspection.load()]));
  }

  #announceTag({ code, distance_m }) {
    const where = chainage(distance_m);
    this.parts.announce.textContent = code
      ? t('desk.tagged', { code, where })
      : t('desk.tagged_point', { where });
  }
}

const exportMarkup = ({ kind, name, help }) => html`<button class="menu__item" data-export="${kind}"><b>${name}</b>
  <span class="dim">${help}</span></button>`;

const exportsMarkup = (id) => html`<div class="menu__list menu__list--exports panel">
  <div class="menu__group" data-part="emergency" hidden>${exportMarkup(EMERGENCY)}</div>
  ${GROUPS.map(({ title, formats }, i) => html`<section class="menu__group" aria-labelledby="exports-${i}">
    <h2 class="menu__title" id="exports-${i}">${title}</h2>
    <ul>${formats.map((format) => html`<li>${exportMarkup(format)}</li>`)}</ul></section>`)}
  <section class="menu__group" aria-labelledby="exports-other">
    <h2 class="menu__title" id="exports-other">${t('export.other')}</h2>
    <ul><li><a class="menu__item" download href="/api/inspections/${id}/track?format=csv"><b>${t('desk.export_track')}</b>
        <span class="dim">${t('desk.export_track_help')}</span></a></li>
      <li><a class="menu__item" href="/compare?a=${id}"><b>${t('compare.with')}</b>
        <span class="dim">${t('compare.with_help')}</span></a></li></ul></section></div>`;

customElements.define('inspection-page', InspectionPage);
