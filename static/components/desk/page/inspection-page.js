/** One inspection: watch the tracking, review it, tag it, export the result. */

import { ApiError, poll } from '../../../core/server/api.js';
import { DeskWindows, followDesk, partOfWindow } from '../../../core/page/desk-windows.js';
import { html, render, renderNew } from '../../../core/page/html.js';
import { isUnfinished } from '../../../core/survey/inspection.js';
import { bindKeys } from '../../../core/page/keys.js';
import { People } from '../../../core/survey/people.js';
import { Component } from '../../../core/page/store.js';
import { chainage } from '../../../core/wall/units.js';
import { defectCount } from '../../../core/defects/stretches.js';
import { errorText, t } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { icon } from '../../shared/icon/icon.js';
import { showKeys } from '../actions/key-help.js';
import { askEndOfRecording, openRecordOn, openRig } from '../dialogs/run-again.js';
import { orToast, toast, toastError } from '../../shared/toast-stack/toast-stack.js';
import { topBar } from '../../shared/top-bar/top-bar.js';
import { openFinish } from '../dialogs/finish-dialog.js';
import { Desk } from './desk.js';
import { VIEWER_KEYS, keyMap } from './key-map.js';
import { followLinks } from '../actions/links.js';
import { buildWindow } from './second-window.js';
import { stepName } from '../actions/step-names.js';
import { TABS } from './tabs.js';
import './conflict-notice.js';
import '../frame/desk-bar.js';
import '../frame/desk-splitter.js';
import '../../distance/readout/distance-readout.js';
import '../frame/emergency-banner.js';
import '../../film/video/live-bar.js';
import './distance-notice.js';
import './sample-notice.js';
import './lock-notice.js';
import '../../distance/strip/strip-log.js';
import '../frame/tab-panels.js';
import '../../film/video/video-panel.js';
import '../../film/views/viewer-panel.js';
import '../../film/views/wall-strip.js';

const TRACK_POLL_S = 0.7;

export class InspectionPage extends Component {
  /** @type {string} */
  inspectionId;
  /** @type {Desk} read by the parts of the page when they are mounted */
  desk;

  #keys;
  #isKept = true;
  #isFollowing = false;

  async mount() {
    document.title = 'Chainage';
    // Without the menu: anything opened in it would vanish when the page is ready.
    render(
      this,
      html`<main id="main" class="content" tabindex="-1"><h1>${t('desk.title')}</h1>
      <p role="status">${t('page.loading')}</p></main>`,
    );
    try {
      this.desk = await Desk.open(this.inspectionId, this.signal);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      render(
        this,
        html`${topBar()}<main id="main" class="content desk-note" tabindex="-1">
        <h1>${t('desk.not_shown')}</h1>
        <p class="message message--error" role="alert">${icon('alert')}<span>${errorText(error)}</span></p>
        <p><a class="button" href="/">${icon('back')}${t('desk.to_list')}</a></p></main>`,
      );
      return;
    }
    this.#build();
  }

  /** Builds the desk, or the one part of it that has this window to itself. */
  #build() {
    const { desk } = this;
    const part = partOfWindow();
    if (part) {
      this.parts = buildWindow(this, part);
      followDesk(desk, part, this.signal);
    } else this.#buildDesk();
    this.listen(desk.inspection, 'change', () => this.#showMessages());
    this.listen(desk.inspection, 'change', () => desk.inspection.isUnfinished && this.#follow());
    this.listen(desk.live, 'message', ({ detail }) => orToast(() => this.#lookFor(detail.header.state)));
    this.listen(desk.outbox, 'change', () => this.#showKept());
    // <conflict-notice> asks about overtaken changes of this inspection.
    this.listen(desk.outbox, 'refused', ({ detail: { operation, error } }) => {
      if (!error.isOvertaken || operation.inspection !== desk.inspection.id) toastError(error);
      if (error.code === 'inspection_locked') orToast(() => desk.readAgain());
    });
    this.listen(desk.attachmentOutbox, 'refused', ({ detail: { error } }) => toastError(error));
    this.listen(desk, 'fault', ({ detail }) => {
      if (detail instanceof Error) this.#fault(detail);
      else toast(detail, { kind: 'error' });
    });
    this.listen(desk, 'done', ({ detail: { text, ...other } }) => this.#showDone(text, other));
    this.#showMessages();
    for (const part of [desk.observations, desk.corrections, desk.review, desk.findings])
      part.load().catch((error) => this.#fault(error));
    if (desk.inspection.isUnfinished) this.followCounter();
    this.#follow({ isOpening: true });
  }

  #buildDesk() {
    const { desk } = this;
    const { name } = desk.inspection.value;
    document.title = `${name} · Chainage`;
    desk.windows = new DeskWindows(desk, this.signal);
    desk.people = new People(desk.live, this.signal);
    const edit = () => desk.people.edit(desk.editing.value ? desk.selection.value : null);
    this.listen([desk.editing, desk.selection], 'change', edit);
    /** @type {Parts<'page/inspection-page'>} */
    this.parts = render(
      this,
      html`<desk-bar></desk-bar>
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
            <div class="desk__notices stack">
              <lock-notice hidden></lock-notice>
              <conflict-notice hidden></conflict-notice>
              <div class="desk-messages stack" data-part="messages"></div>
              <emergency-banner hidden></emergency-banner>
              <distance-notice hidden></distance-notice>
              <sample-notice hidden></sample-notice>
            </div>
          </div>
        </main>
        <p class="visually-hidden" role="status" data-part="announce"></p>`,
    );
    this.video = this.parts.video;
    this.strip = this.parts.strip;
    this.parts.side.fill(TABS, t('tab.label'), desk.tab);
    desk.seek = (frame) => this.video.seek(frame);

    const { parts } = this;
    this.listen(desk.observations, 'change', () => this.#showObservations());
    this.listen(desk.editing, 'change', () => desk.editing.value && desk.tab.set('defects'));
    this.listen(desk.editing, 'change', () => parts.all.toggleAttribute('data-editing', desk.editing.value));
    this.listen(desk.large, 'change', () => {
      if (desk.large.value) parts.all.dataset.large = desk.large.value;
      else delete parts.all.dataset.large;
    });
    this.listen(desk.windows, 'change', () =>
      parts.all.toggleAttribute('data-viewer-away', desk.windows.has('viewer')),
    );
    this.listen(desk.asking, 'change', () => {
      parts.all.toggleAttribute('data-asking', desk.asking.value !== null);
      if (desk.asking.value === 'all') this.video.scrollIntoView({ block: 'nearest' });
    });
    this.listen(desk, 'tagged', ({ detail }) => {
      this.#announceTag(detail);
      desk.ask(detail);
    });
    this.listen(desk.review, 'change', () => this.#showQuestions());
    this.listen(desk.findings, 'change', () =>
      parts.side.note('findings', String(desk.findings.in('offered').length || '')),
    );
    this.listen(desk.checks, 'change', () => parts.side.note('checks', String(desk.checks.value?.length || '')));

    const groups = keyMap(this);
    this.#keys = groups;
    const bindings = groups.flatMap((group) => group.bindings);
    bindKeys(document, bindings, this.signal);
    bindKeys(parts.viewer.keys, bindings, this.signal, VIEWER_KEYS);
    parts.viewer.bound = bindings.flatMap((binding) => binding.keys).filter((key) => !VIEWER_KEYS.has(key));

    this.#showQuestions();
    this.#showObservations();
    followLinks(desk, this.signal);
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
      if (isDamage(error)) this.#fault(error);
      else this.#showMessages(error.isTemporary ? t('page.trying_again', { reason }) : reason);
    };
    await poll(
      async () => {
        if (desk.inspection.isUnfinished) await desk.inspection.load();
        // Read after the state: a track fetched after the end is complete.
        await desk.track.extend(this.signal);
        await desk.health.extend(this.signal);
        isListOld ||= desk.inspection.isUnfinished;
        if (desk.inspection.isUnfinished) return TRACK_POLL_S;
        if (isListOld) await desk.readPlaces();
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

  /** Follows the reading of the burnt-in counter, while or after an uploaded film is tracked. */
  followCounter() {
    const { desk } = this;
    const { live } = desk.inspection.value;
    if (live === null || !desk.inspection.isUnfinished)
      desk.counter.follow((error) => this.#showMessages(errorText(error)));
  }

  /** A recording that has ended cannot be repeated, so this asks first. */
  cancel() {
    const { inspection } = this.desk;
    return orToast(async () => {
      if (inspection.value.live === null || (await askEndOfRecording())) await inspection.cancel();
    });
  }

  async recordOn() {
    if (await openRecordOn(this.desk.inspection)) location.reload(); // the page of a film becomes that of a camera
  }

  /** Asks what to change first. @param {string} [repair] where the dialog begins: 'axis', 'pipe', 'lens' or 'again' */
  async trackAgain(repair) {
    if (await openRig(this.desk, { repair })) location.reload(); // the picture and the 3D view change too
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
    else
      await this.correct({ ...corrections.value.stated, zero }, null, { text: t('corrections.zero_set', { frame }) });
  }

  /**
   * Changes the statements about the distances; the message about it offers an undo.
   * @param {import('../../../core/survey/corrections.js').Stated} stated
   * @param {string|null} remark
   * @param {{text?: string, replaced?: string}} [how] replaced: version that the change is based on
   */
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
    const { desk } = this;
    if (!desk.selection.value) return;
    desk.asking.set(null);
    if (desk.editing.value) this.querySelector('defect-form').enter();
    else desk.editing.set(true);
  }

  leave() {
    if (this.desk.large.value) this.desk.large.leave();
    else if (this.desk.picking.value) this.desk.picking.set(null);
    else if (this.desk.editing.value) this.desk.editing.set(false);
    else this.desk.selection.set(null);
  }

  help() {
    showKeys(this.#keys, { isChangeable: true });
  }

  /** Says why something failed; a damaged track is said once, and for as long as it is damaged. */
  #fault(error) {
    if (isDamage(error)) this.desk.inspection.noteDamage(errorText(error));
    else toastError(error);
  }

  // What changes on the page ------------------------------------------------------------------

  #showQuestions() {
    this.parts.side.note('review', String(this.desk.review.waiting || ''));
  }

  #showMessages(trouble = null) {
    const { damage } = this.desk.inspection;
    const { error, warning } = this.desk.inspection.value;
    const messages = [
      damage && ['error', damage],
      error && ['error', errorText(error)],
      warning && ['warning', warning],
      trouble && ['warning', trouble],
      !this.desk.outbox.isKept && ['warning', t('desk.not_kept')],
    ].filter(Boolean);
    renderNew(
      this.parts.messages,
      html`${messages.map(
        ([kind, sentence]) => html`<p class="message message--${kind}" role="alert" tabindex="0">
        ${icon('alert')}<span>${sentence}</span></p>`,
      )}`,
    );
  }

  #showKept() {
    if (this.#isKept === this.desk.outbox.isKept) return;
    this.#isKept = this.desk.outbox.isKept;
    this.#showMessages();
  }

  #showObservations() {
    this.parts.side.note('defects', String(defectCount(this.desk.observations.value) || ''));
  }

  #announceTag({ code, distance_m }) {
    const where = chainage(distance_m);
    this.parts.announce.textContent = code ? t('desk.tagged', { code, where }) : t('desk.tagged_point', { where });
  }
}

const isDamage = ({ code }) => code === 'damaged_track';

customElements.define('inspection-page', InspectionPage);
