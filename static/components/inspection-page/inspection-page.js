/** One inspection: watch it being tracked, review it, tag it, take the result home. */

import { ApiError, poll } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { bindKeys } from '../../core/keys.js';
import { Component } from '../../core/store.js';
import { metres } from '../../core/units.js';
import { icon } from '../icon/icon.js';
import { pace } from '../inspection-list/inspection-list.js';
import { keyHelp } from '../key-help/key-help.js';
import { statusChip } from '../status-chip/status-chip.js';
import { toast, toastError } from '../toast-stack/toast-stack.js';
import { Desk } from './desk.js';
import { VIEWER_KEYS, keyMap } from './key-map.js';
import '../defect-list/defect-list.js';
import '../distance-readout/distance-readout.js';
import '../distance-strip/distance-strip.js';
import '../video-panel/video-panel.js';
import '../viewer-panel/viewer-panel.js';

const TRACK_POLL_S = 0.7;
const EXPORTS = [
  ['exports/csv', 'Defects, CSV', 'For spreadsheets and other programs'],
  ['exports/json', 'Defects, JSON', 'Everything, for programs'],
  ['track?format=csv', 'Track, CSV', 'The distance of every frame'],
];

class InspectionPage extends Component {
  /** @type {string} */
  inspectionId;
  /** @type {Desk} read by the parts of the page when they are mounted */
  desk;

  async mount() {
    document.title = 'Chainage';
    render(this, html`${topbar()}<main id="main" class="desk-note" tabindex="-1"><h1>Inspection</h1>
      <p role="status">Loading…</p></main>`);
    try {
      this.desk = await Desk.open(this.inspectionId, this.signal);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      render(this, html`${topbar()}<main id="main" class="content" tabindex="-1"><h1>This inspection cannot be shown</h1>
        <p class="message message--error" role="alert">${icon('alert')}<span>${error.message}</span></p></main>`);
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
            <a class="brand" href="/" aria-label="All inspections">${icon('back')}${icon('logo')}</a>
            <h1 class="desk-bar__name" title="${name}">${name}</h1>
            <span role="status" data-part="chip"></span>
            <span class="desk-bar__pace dim number" data-part="pace"></span>
          </div>
          <div class="desk-bar__tools">
            <button class="button button--small" data-part="cancel" hidden>${icon('stop')}Cancel</button>
            <button class="button button--small" data-part="retry" hidden>${icon('retry')}Track again</button>
            <span class="spacer"></span>
            <p class="save number" role="status" data-part="save"></p>
            <button class="button button--quiet button--small" data-part="undo" title="Undo (U)">${icon('undo')}
              <span class="desk-bar__word">Undo</span></button>
            <button class="button button--quiet button--small" data-part="help" title="Keys (?)">${icon('keys')}
              <span class="desk-bar__word">Keys</span></button>
            <details class="menu" data-part="menu">
              <summary class="button button--small button--primary">${icon('download')}Export</summary>
              <ul class="menu__list panel">
                ${EXPORTS.map(([path, label, help]) => html`<li><a class="menu__item" download
                  href="/api/inspections/${id}/${path}"><b>${label}</b><span class="dim">${help}</span></a></li>`)}
              </ul>
            </details>
          </div>
          <progress class="bar desk-bar__progress" max="1" data-part="bar" aria-label="Tracking progress"></progress>
        </header>
        <main id="main" class="desk-main" tabindex="-1">
          <div class="desk-messages" data-part="messages"></div>
          <div class="desk">
            <distance-readout class="desk__readout panel"></distance-readout>
            <video-panel class="desk__video" data-part="video"></video-panel>
            <distance-strip class="desk__strip panel"></distance-strip>
            <viewer-panel class="desk__viewer panel" data-part="viewer"></viewer-panel>
            <defect-list class="desk__defects panel"></defect-list>
          </div>
        </main>
        <p class="visually-hidden" role="status" data-part="announce"></p>`,
    );
    this.video = this.parts.video;
    desk.seek = (frame) => this.video.seek(frame);

    const { parts } = this;
    this.listen(desk.inspection, 'change', () => this.#showState());
    this.listen(desk.outbox, 'change', () => this.#showSaving());
    this.listen(desk.outbox, 'refused', ({ detail }) => toastError(detail.error));
    this.listen(desk.observations, 'change', () => this.#showUndo());
    this.listen(desk, 'fault', ({ detail }) => toast(detail, { kind: 'error' }));
    this.listen(desk, 'tagged', ({ detail }) => this.#announceTag(detail));
    this.listen(parts.cancel, 'click', () => this.#command(() => desk.inspection.cancel()));
    this.listen(parts.retry, 'click', () => this.#command(() => this.#retry()));
    this.listen(parts.undo, 'click', () => this.undo());
    this.listen(parts.help, 'click', () => this.help());
    this.#closeMenuElsewhere();

    const groups = keyMap(this);
    this.keyHelp = keyHelp(groups);
    this.append(this.keyHelp);
    const bindings = groups.flatMap((group) => group.bindings);
    bindKeys(document, bindings, this.signal);
    parts.viewer.onframe = (frame) => bindKeys(frame, bindings, this.signal, VIEWER_KEYS);

    this.#showState();
    this.#showSaving();
    this.#showUndo();
    desk.observations.load().catch(toastError);
    this.#follow();
  }

  /** Fetches the growing track until tracking has ended, then what may have changed with it. */
  async #follow() {
    const { desk } = this;
    const onError = ({ message, isTemporary }) =>
      this.#showMessages(isTemporary ? `${message} Trying again…` : message);
    await poll(
      async () => {
        if (desk.inspection.isUnfinished) await desk.inspection.load();
        // Read after the state: a track that is fetched once it has ended is whole.
        await desk.track.extend(this.signal);
        if (desk.inspection.isUnfinished) return TRACK_POLL_S;
        await desk.observations.load();
        return null;
      },
      this.signal,
      onError,
    );
    if (!this.signal.aborted) this.#showMessages();
  }

  async #retry() {
    await this.desk.inspection.retry();
    this.desk.playhead.set({ frame: -1, row: null, isLive: true });
    this.desk.track.clear();
    this.#follow();
  }

  async #command(run) {
    try {
      await run();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      toastError(error);
    }
  }

  // Commands of the keys and buttons ---------------------------------------------------------

  undo() {
    const step = this.desk.observations.undo();
    if (!step) return;
    const { what, observation } = step;
    const name = `${observation.code || 'tag'} at ${metres(observation.distance_m)}`;
    const texts = { tag: `Took back ${name}`, edit: `Took back the edit of ${name}`, delete: `Restored ${name}` };
    toast(texts[what]);
  }

  remove(id = this.desk.selection.value) {
    const item = id && this.desk.observations.find(id);
    if (!item) return;
    this.desk.editing.set(false);
    this.desk.observations.remove(id);
    toast(`Deleted ${item.code || 'tag'} at ${metres(item.distance_m)}`, {
      action: 'Undo',
      run: () => this.undo(),
    });
  }

  edit() {
    if (this.desk.selection.value) this.desk.editing.set(true);
  }

  leave() {
    if (this.desk.editing.value) this.desk.editing.set(false);
    else this.desk.selection.set(null);
  }

  help() {
    this.keyHelp.showModal();
  }

  // What the top bar shows -------------------------------------------------------------------

  #showState() {
    const { parts, desk } = this;
    const { status, progress } = desk.inspection.value;
    if (parts.chip.dataset.status !== status) {
      parts.chip.dataset.status = status;
      render(parts.chip, statusChip(status));
    }
    const isRunning = status === 'running';
    parts.pace.textContent = isRunning ? pace(progress) : '';
    parts.bar.classList.toggle('desk-bar__progress--off', !isRunning);
    parts.bar.value = progress.frames_total ? progress.frames_done / progress.frames_total : 0;
    parts.cancel.hidden = !desk.inspection.isUnfinished;
    parts.retry.hidden = status !== 'failed' && status !== 'cancelled';
    this.#showMessages();
  }

  #showMessages(trouble = null) {
    const { error, warning } = this.desk.inspection.value;
    const messages = [
      error && ['error', error.detail],
      warning && ['warning', warning],
      trouble && ['warning', trouble],
    ].filter(Boolean);
    const text = JSON.stringify(messages);
    if (this.parts.messages.dataset.shows === text) return;
    this.parts.messages.dataset.shows = text;
    render(
      this.parts.messages,
      html`${messages.map(([kind, sentence]) => html`<p class="message message--${kind}" role="alert">
        ${icon('alert')}<span>${sentence}</span></p>`)}`,
    );
  }

  #showSaving() {
    const { count, reason } = this.desk.outbox;
    const isStuck = reason !== null && count > 0;
    this.parts.save.textContent = count === 0 ? 'Saved' : `Waiting (${count})`;
    this.parts.save.title = isStuck ? reason : '';
    this.parts.save.classList.toggle('save--waiting', count > 0);
  }

  #showUndo() {
    this.parts.undo.disabled = !this.desk.observations.canUndo;
  }

  #announceTag({ code, distance_m }) {
    this.parts.announce.textContent = `Tagged ${code || 'a point'} at ${metres(distance_m)}`;
  }

  #closeMenuElsewhere() {
    const { menu } = this.parts;
    const close = () => (menu.open = false);
    this.listen(document, 'click', (event) => {
      const isElsewhere = !menu.contains(event.target) || event.target.closest('.menu__item');
      if (isElsewhere) close();
    });
    this.listen(window, 'blur', close);
    this.listen(menu, 'keydown', (event) => {
      if (event.key !== 'Escape' || !menu.open) return;
      event.stopPropagation();
      close();
      menu.querySelector('summary').focus();
    });
  }
}

const topbar = () => html`<header class="topbar"><a class="brand" href="/">${icon('back')}${icon('logo')}Chainage</a></header>`;

customElements.define('inspection-page', InspectionPage);
