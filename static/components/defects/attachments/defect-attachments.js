/** What is attached to a defect: its photos as a row of small pictures, its voice notes, its clip. */

import { html, patchList, render, setText } from '../../../core/page/html.js';
import { isUnfinished } from '../../../core/survey/inspection.js';
import { withKey } from '../../../core/page/keys.js';
import { mayEdit } from '../../../core/page/rights.js';
import { squareOf } from '../../../core/wall/pixels.js';
import { Component } from '../../../core/page/store.js';
import { timecode } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { nameOf } from '../defect-list/names.js';
import { icon } from '../../shared/icon/icon.js';
import { addPhoto, detach } from './actions.js';
import { openClip } from './clip-dialog.js';
import { openPhotos } from './photo-dialog.js';
import { photosOf } from './photos.js';
import { canRecord, record } from './recorder.js';
import { paintStrokes } from './strokes.js';

const TICK_MS = 500;
/** Width in which the strokes of a small picture are drawn, twice that of the picture for dense screens. */
const THUMB_PX = 256;

export class DefectAttachments extends Component {
  /** The recording that runs, or null. */
  #recording = null;
  #isAsking = false;
  #timer = 0;
  /** Addresses of voice notes that are only in this browser, by their id. */
  #addresses = new Map();

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.observationId = this.closest('defect-form').observationId;
    /** @type {Parts<'attachments/defect-attachments'>} */
    this.parts = render(
      this,
      html`<ul class="thumbs flow" aria-label="${t('attach.photos')}" data-part="photos"></ul>
        <div class="flow">
          <button type="button" class="button button--small" data-needs="operator" data-part="add"
            title="${withKey(t('attach.add_photo'), 'Shift + P')}">${icon('plus')}${t('attach.add_photo')}</button>
          <button type="button" class="button button--small" data-needs="operator" data-part="record"
            aria-describedby="voice-fault"></button>
          <button type="button" class="button button--small" data-part="clip">${icon('film')}${t('attach.clip')}</button>
        </div>
        <p class="help" id="voice-fault" role="status" data-part="fault"></p>
        <ul class="voices stack" aria-label="${t('attach.voices')}" data-part="voices"></ul>`,
    );
    const { parts, desk } = this;
    this.listen(parts.add, 'click', () => addPhoto(desk, this.observationId));
    this.listen(parts.record, 'click', () => this.#toggleRecording());
    this.listen(parts.clip, 'click', () => openClip(desk.inspection.id, this.#item, nameOf(this.#item)));
    this.listen(parts.photos, 'click', ({ target }) => {
      const button = target.closest('button');
      if (button) openPhotos(desk, this.observationId, button.closest('li').dataset.key, nameOf(this.#item));
    });
    this.listen(parts.voices, 'click', ({ target }) => {
      const button = target.closest('[data-do]');
      if (button) this.#doWithNote(button.dataset.do, button.closest('li').dataset.key);
    });
    for (const store of [desk.attachments, desk.observations, desk.inspection])
      this.listen(store, 'change', () => this.#fill());
    this.signal.addEventListener('abort', () => this.#leave());
    this.#fill();
  }

  get #item() {
    return this.desk.observations.find(this.observationId);
  }

  async #toggleRecording() {
    if (this.#recording) this.#recording.stop();
    else if (!this.#isAsking) await this.#startRecording();
  }

  async #startRecording() {
    const { desk, parts } = this;
    const item = this.#item;
    this.#isAsking = true;
    parts.fault.textContent = '';
    try {
      this.#recording = await record((sound, durationS) => {
        desk.attachments.say(item, sound, durationS);
        this.#recording = null;
        clearInterval(this.#timer);
        if (this.isConnected) this.#fill();
      });
      if (this.isConnected) this.#timer = setInterval(() => this.#fillRecording(), TICK_MS);
      else this.#recording.discard(); // the form was closed while the browser asked
    } catch (error) {
      if (!(error instanceof DOMException)) throw error;
      parts.fault.textContent =
        error.name === 'NotAllowedError' ? t('attach.microphone_refused') : t('attach.no_microphone');
    } finally {
      this.#isAsking = false;
    }
    if (this.isConnected) this.#fill();
  }

  #doWithNote(what, id) {
    const { attachments } = this.desk;
    const note = attachments.value.find((item) => item.id === id);
    if (what === 'delete') detach(this.desk, this.#item, note);
    if (what === 'again') attachments.sendAgain(note);
    if (what === 'drop') attachments.giveUp(note);
  }

  #fill() {
    const item = this.#item;
    if (!item) return;
    const { parts, desk } = this;
    const photos = photosOf(desk, item);
    parts.photos.hidden = photos.length === 0;
    patchList(
      parts.photos,
      photos,
      ({ id }) => id,
      createThumb,
      (element, photo) => this.#fillThumb(element, photo, photos.indexOf(photo)),
    );
    const items = desk.attachments.of(item.id).filter(({ kind, save }) => kind === 'voice' || save === 'refused');
    parts.voices.hidden = items.length === 0;
    patchList(
      parts.voices,
      items,
      ({ id }) => id,
      () => Object.assign(document.createElement('li'), { className: 'row wrap' }),
      (element, note) => this.#fillNote(element, note),
    );
    const { value } = desk.inspection;
    const hasFilm = value.source.kind !== 'import';
    parts.add.hidden = !hasFilm;
    parts.clip.hidden = !hasFilm || isUnfinished(value);
    this.#fillRecording();
  }

  #fillThumb(element, { url, strokes, attachment }, n) {
    const [button, picture, canvas] = [
      element.firstChild,
      element.querySelector('img'),
      element.querySelector('canvas'),
    ];
    if (picture.getAttribute('src') !== url) picture.src = url;
    const label = n === 0 ? t('form.photo') : t('attach.photo_n', { n: n + 1 });
    button.setAttribute('aria-label', label);
    button.title = label;
    element.classList.toggle('thumbs__waiting', attachment !== null && attachment.save !== 'saved');
    canvas.hidden = strokes.length === 0;
    if (strokes.length) paintStrokes(canvas, strokes, squareOf(this.desk.inspection.value.video), THUMB_PX);
  }

  #fillNote(element, note) {
    const { id, kind, save, file, refusal, duration_s: seconds } = note;
    const shows = JSON.stringify([save, file, refusal]);
    if (element.dataset.shows === shows) return;
    element.dataset.shows = shows;
    const name =
      kind === 'voice' ? t('attach.voice_note', { length: timecode(seconds, 0) }) : wordFor('attach.kind', kind);
    const address = file ?? this.#addressOf(note);
    /** @type {[string, import('../../shared/icon/icon.js').IconName, string][]} what, sign, label */
    const offers =
      save === 'refused'
        ? [
            ['again', 'retry', t('form.send_again')],
            ['drop', 'undo', t('form.give_up')],
          ]
        : [['delete', 'trash', t('attach.delete')]];
    render(
      element,
      html`<p class="voices__name number">${name}${save === 'waiting' && html` <span class="dim">${t('attach.waiting')}</span>`}</p>
        ${kind === 'voice' && address && html`<audio controls preload="none" src="${address}" aria-label="${name}"></audio>`}
        ${
          mayEdit() &&
          offers.map(
            ([what, sign, label]) => html`<button type="button" class="button button--quiet button--small button--icon"
          data-do="${what}" title="${label}" aria-label="${label}">${icon(sign)}</button>`,
          )
        }
        ${refusal && html`<p class="fault">${refusal}</p>`}`,
    );
    if (file) this.#forget(id);
  }

  #addressOf({ id, sound }) {
    if (!this.#addresses.has(id) && sound) this.#addresses.set(id, URL.createObjectURL(sound));
    return this.#addresses.get(id);
  }

  #forget(id) {
    URL.revokeObjectURL(this.#addresses.get(id));
    this.#addresses.delete(id);
  }

  #fillRecording() {
    const { record: button } = this.parts;
    const isOn = this.#recording !== null;
    if (button.dataset.isOn !== String(isOn)) {
      button.dataset.isOn = isOn;
      render(button, html`${icon(isOn ? 'stop' : 'voice')}<span>${t('attach.record')}</span>`);
    }
    button.classList.toggle('voices__recording', isOn);
    button.disabled = !canRecord() || !mayEdit();
    button.title = canRecord() ? '' : t('attach.needs_https');
    const seconds = isOn ? (performance.now() - this.#recording.since) / 1000 : 0;
    setText(
      button.lastElementChild,
      isOn ? t('attach.stop_recording', { length: timecode(seconds, 0) }) : t('attach.record'),
    );
  }

  /** The form is closed: what was said so far is kept. */
  #leave() {
    this.#recording?.stop();
    clearInterval(this.#timer);
    for (const id of [...this.#addresses.keys()]) this.#forget(id);
  }
}

function createThumb() {
  const element = document.createElement('li');
  render(
    element,
    html`<button type="button" class="thumbs__photo framed--strong holds"><img alt="" /><canvas class="covers" aria-hidden="true" hidden></canvas></button>`,
  );
  return element;
}

customElements.define('defect-attachments', DefectAttachments);
