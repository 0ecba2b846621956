/**
 * New inspection: the video is uploaded while the header and the rig are filled in, or a camera is chosen.
 */

import { ApiError, get, poll, post, remove, session } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { preferences } from '../../core/preferences.js';
import { Component } from '../../core/store.js';
import { bytes, date, duration } from '../../core/units.js';
import { errorText, pieces, t } from '../../core/words.js';
import { Upload, discardUpload, unfinishedUploads } from '../../core/upload.js';
import { icon } from '../icon/icon.js';
import { topBar } from '../top-bar/top-bar.js';
import '../header-form/header-form.js';
import '../rig-form/rig-form.js';
import '../source-picker/source-picker.js';

const REMEMBERED = 'chainage.header';
const ACCEPTED = 'video/*,.mp4,.mov,.m4v,.mkv,.avi,.mpg,.mpeg,.ts,.webm';

/** Fields known only after the survey, or filled in by the program. */
const NOT_YET = new Set(['end_condition', 'abandon_reason', 'video_files']);
/**
 * People and equipment, which are proposed for the next inspection. Other fields belong to the asset or the
 * day.
 */
const REMEMBERED_FIELDS = new Set([
  'client', 'contractor', 'operator', 'operator_certificate', 'reviewer', 'method', 'standard', 'edition',
  'code_pack', 'rig_id', 'calibration_id', 'camera', 'lens', 'camera_offset_m', 'tether',
]);
const ASK_CAMERA_EVERY_S = 0.3;
const STANDARD = { standard: 'EN 13508-2', edition: '2003+A1:2011' };

class NewInspection extends Component {
  #upload = null;
  #file = null;
  #isWanted = false;
  /** Ends the wait for the camera's first picture; null while there is no wait. */
  #connecting = null;

  mount() {
    document.title = t('new.page');
    this.parts = render(
      this,
      html`${topBar(t('new.title'))}
        <main id="main" class="content new" tabindex="-1">
          <div class="content__head"><h1>${t('new.title')}</h1></div>
          <form class="new__form" data-part="form" data-needs="operator" novalidate>
            <section class="panel new__section" aria-labelledby="new-video">
              <h2 id="new-video">${t('new.video')}</h2>
              <fieldset class="new__kinds" data-part="kinds">
                <legend class="visually-hidden">${t('new.kind')}</legend>
                ${kind('upload', 'film', t('new.kind_file'), true)}
                ${kind('live', 'live', t('new.kind_live'), false)}
              </fieldset>
              <source-picker data-part="camera" hidden></source-picker>
              <div class="drop" data-part="drop">
                <div class="drop__ask" data-part="ask">
                  ${icon('film')}
                  <p>${t('new.drop')}</p>
                  <button type="button" class="button" data-part="pick">${t('new.pick')}</button>
                  <p class="help">${t('new.formats')}</p>
                </div>
                <div class="drop__file" data-part="chosen" hidden>
                  <p class="drop__name"><b data-part="fileName"></b> <span class="dim number" data-part="fileSize"></span></p>
                  <progress class="bar" data-part="bar" max="1" aria-label="${t('new.upload_progress')}"></progress>
                  <p class="drop__state number" role="status" data-part="state"></p>
                  <div class="drop__buttons">
                    <button type="button" class="button button--small" data-part="pause"></button>
                    <button type="button" class="button button--small" data-part="cancel">${t('new.remove')}</button>
                  </div>
                </div>
                <input type="file" accept="${ACCEPTED}" data-part="input" hidden />
              </div>
              <div data-part="unfinished"></div>
              <p class="fault" role="alert" data-part="videoFault"></p>
            </section>

            <section class="panel new__section" aria-labelledby="new-header">
              <h2 id="new-header">${t('new.what')}</h2>
              <div class="field">
                <label for="new-name">${t('new.name')}</label>
                <input class="input" id="new-name" maxlength="200" autocomplete="off" data-part="name"
                  aria-describedby="new-name-fault" />
                <span class="fault" id="new-name-fault" data-part="nameFault"></span>
              </div>
              <header-form data-part="header"></header-form>
            </section>

            <section class="panel new__section" aria-labelledby="new-rig">
              <h2 id="new-rig">${t('new.rig')}</h2>
              <rig-form data-part="rig"></rig-form>
            </section>

            <div class="new__foot">
              <p class="fault" role="alert" data-part="fault"></p>
              <button type="button" class="button" data-part="stop" hidden>${t('page.cancel')}</button>
              <button class="button button--primary" data-part="start">${t('new.start')}</button>
            </div>
          </form>
        </main>`,
    );
    const { drop, input, pick, pause, cancel, form } = this.parts;
    this.parts.header.without = NOT_YET;
    this.listen(this.parts.kinds, 'change', () => this.#showKind());
    this.listen(this.parts.camera, 'source', () => (this.parts.rig.videoSize = null));
    this.listen(this.parts.stop, 'click', () => this.#connecting?.abort());
    this.listen(pick, 'click', () => input.click());
    this.listen(input, 'change', () => this.#choose(input.files[0]));
    this.listen(drop, 'dragover', (event) => this.#drag(event, true));
    this.listen(drop, 'dragleave', (event) => this.#drag(event, false));
    this.listen(drop, 'drop', (event) => {
      this.#drag(event, false);
      this.#choose(event.dataTransfer.files[0]);
    });
    this.listen(pause, 'click', () => this.#pauseOrGoOn());
    this.listen(cancel, 'click', () => this.#removeFile());
    this.listen(this.parts.name, 'input', () => this.#checkName());
    this.listen(form, 'submit', (event) => {
      event.preventDefault();
      this.#submit();
    });
    this.listen(window, 'beforeunload', (event) => {
      if (this.#upload?.state === 'SENDING') event.preventDefault();
    });
    // The log-in page is next: the question about leaving would be in its way.
    this.listen(session, 'signed-out', () => this.#upload?.pause());
    this.listen(this.parts.rig, 'rig', () => this.#suggestPipe());
    this.#recall();
    this.#showUnfinished();
  }

  get #isLive() {
    return this.parts.kinds.querySelector(':checked').value === 'live';
  }

  #showKind() {
    const isLive = this.#isLive;
    const { camera, drop, unfinished, rig, name, videoFault } = this.parts;
    camera.hidden = !isLive;
    drop.hidden = unfinished.hidden = isLive;
    videoFault.textContent = '';
    if (!isLive && this.#file) this.#measure(this.#file);
    else rig.videoSize = null;
    if (isLive && !name.value) name.value = t('new.live_name', { time: date(new Date()) });
    this.#want(false);
  }

  #drag(event, isOver) {
    event.preventDefault();
    this.parts.drop.classList.toggle('drop--over', isOver);
  }

  async #choose(file) {
    if (!file) return;
    this.#upload?.cancel();
    this.#file = file;
    this.#upload = new Upload(file);
    this.listen(this.#upload, 'change', () => this.#showUpload());
    this.parts.ask.hidden = true;
    this.parts.chosen.hidden = false;
    this.parts.fileName.textContent = file.name;
    this.parts.fileSize.textContent = bytes(file.size);
    this.parts.videoFault.textContent = '';
    if (!this.parts.name.value) this.parts.name.value = file.name.replace(/\.[^.]+$/, '');
    this.#checkName();
    this.#showUnfinished();
    this.#measure(file);
    await this.#upload.start();
  }

  /** Returns the size of the picture, if this browser can open the file. */
  #measure(file) {
    const video = document.createElement('video');
    const url = URL.createObjectURL(file);
    const finish = (size) => {
      URL.revokeObjectURL(url);
      if (this.#file === file) this.parts.rig.videoSize = size;
    };
    video.preload = 'metadata';
    video.onloadedmetadata = () => finish([video.videoWidth, video.videoHeight]);
    video.onerror = () => finish(null);
    video.src = url;
  }

  #showUpload() {
    const { state, offset, size, speed, etaS, reason } = this.#upload;
    const share = size ? offset / size : 1;
    this.parts.bar.value = share;
    const percent = Math.floor(100 * share);
    const pace = speed ? ` · ${bytes(speed)}/s` : '';
    const left = etaS === null ? '' : ` · ${t('new.left', { time: duration(etaS) })}`;
    this.parts.state.textContent = {
      IDLE: '',
      SENDING: `${t('new.sending', { percent })}${pace}${left}`,
      WAITING: t('new.waiting', { percent, reason: reason ?? '' }),
      PAUSED: t('new.paused', { percent }),
      DONE: t('new.uploaded'),
      FAILED: reason,
      CANCELLED: '',
    }[state];
    const isStopped = state === 'PAUSED' || state === 'FAILED';
    this.parts.pause.textContent = isStopped ? t('new.go_on') : t('new.pause');
    this.parts.pause.hidden = state === 'DONE';
    this.parts.state.classList.toggle('drop__state--failed', state === 'FAILED');
    if (state === 'DONE' && this.#isWanted) this.#create();
    if (state === 'FAILED') this.#want(false);
  }

  #pauseOrGoOn() {
    if (this.#upload.state === 'PAUSED' || this.#upload.state === 'FAILED') this.#upload.start();
    else this.#upload.pause();
  }

  async #removeFile() {
    const upload = this.#upload;
    this.#upload = null;
    this.#file = null;
    this.#want(false);
    this.parts.rig.videoSize = null;
    this.parts.input.value = '';
    this.parts.ask.hidden = false;
    this.parts.chosen.hidden = true;
    this.parts.pick.focus();
    await upload.cancel();
  }

  #submit() {
    this.parts.fault.textContent = '';
    const isNamed = this.#checkName();
    const isRigGood = this.parts.rig.check();
    if (this.#isLive) {
      if (!isNamed) this.parts.name.focus();
      if (this.parts.camera.check() && isNamed && isRigGood) this.#connect();
      return;
    }
    this.parts.videoFault.textContent = this.#upload ? '' : t('new.choose_first');
    if (!this.#upload) this.parts.pick.focus();
    else if (!isNamed) this.parts.name.focus();
    if (!this.#upload || !isNamed || !isRigGood) return;
    this.#want(true);
    if (this.#upload.state === 'DONE') this.#create();
    else if (this.#upload.state === 'PAUSED' || this.#upload.state === 'FAILED') this.#upload.start();
  }

  #checkName() {
    const isNamed = this.parts.name.value.trim() !== '';
    this.parts.nameFault.textContent = isNamed ? '' : t('new.name_needed');
    this.parts.name.setAttribute('aria-invalid', String(!isNamed));
    return isNamed;
  }

  /** Sets whether tracking starts as soon as the upload is complete. */
  #want(isWanted) {
    this.#isWanted = isWanted;
    this.#showStart(isWanted ? t('new.starts_later') : '');
  }

  /** @param {string} waiting the pending event; nothing can be started meanwhile */
  #showStart(waiting) {
    this.parts.start.disabled = waiting !== '';
    this.parts.start.textContent = waiting || (this.#isLive ? t('new.record') : t('new.start'));
  }

  /** @param {object} source where the pictures come from */
  #post(source) {
    const header = this.parts.header.value;
    this.#remember(header);
    const [name, rig] = [this.parts.name.value.trim(), this.parts.rig.value];
    return post('/api/inspections', { name, source, rig, header });
  }

  /** Starts the camera and opens its page when it delivers pictures; otherwise deletes the inspection. */
  async #connect() {
    const { camera, stop, fault } = this.parts;
    this.#connecting = new AbortController();
    this.#showStart(t('live.connecting'));
    stop.hidden = false;
    try {
      const { id } = await this.#post({ kind: 'live', url: camera.value });
      const signal = AbortSignal.any([this.#connecting.signal, this.signal]);
      const refused = await this.#refusal(id, signal);
      if (!refused && !signal.aborted) {
        camera.remember();
        location.assign(`/inspections/${id}`);
        return;
      }
      await remove(`/api/inspections/${id}`);
      if (refused) this.#showRefusal(refused);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (error.code === 'live_source_refused') camera.fault(errorText(error));
      else fault.textContent = errorText(error);
    }
    this.#connecting = null;
    stop.hidden = true;
    this.#showStart('');
  }

  /**
   * Returns why the camera delivers no pictures, as an error of the API; null when it does, or on `signal`.
   */
  async #refusal(id, signal) {
    let refused = null;
    await poll(
      async () => {
        const { status, error, live } = await get(`/api/inspections/${id}`, signal);
        refused = status === 'failed' ? error : null;
        return status === 'running' && !live?.connected ? ASK_CAMERA_EVERY_S : null;
      },
      signal,
      (error) => (refused = { code: error.code, detail: error.message }),
    );
    return refused;
  }

  #showRefusal(error) {
    const { camera, rig } = this.parts;
    const size = /(\d+)x(\d+) px/.exec(error.detail);
    if (error.code === 'rig_video_mismatch' && size) {
      rig.videoSize = [Number(size[1]), Number(size[2])];
      rig.check();
    } else camera.fault(errorText(error));
  }

  async #create() {
    this.#isWanted = false;
    try {
      const { id } = await this.#post({ kind: 'upload', upload_id: this.#upload.id });
      this.#upload.forget();
      location.assign(`/inspections/${id}`);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      const reason = errorText(error);
      this.parts.fault.textContent = reason;
      this.#want(false);
      if (!error.isTemporary) await this.#upload.reject({ code: error.code, reason });
    }
  }

  #remember(header) {
    localStorage.setItem(REMEMBERED, JSON.stringify(rememberedOf(header)));
    this.parts.rig.remember();
  }

  /** Fills in people and equipment of the last inspection, the present time, and values from the rig. */
  #recall() {
    const { header } = this.parts;
    const now = new Date();
    const digits = (number) => String(number).padStart(2, '0');
    header.value = rememberedOf(JSON.parse(localStorage.getItem(REMEMBERED) ?? '{}'));
    header.suggest({
      ...STANDARD,
      date: `${now.getFullYear()}-${digits(now.getMonth() + 1)}-${digits(now.getDate())}`,
      time: `${digits(now.getHours())}:${digits(now.getMinutes())}`,
      code_pack: preferences.value.pack ?? undefined,
    });
    this.#suggestPipe();
  }

  #suggestPipe() {
    const { pipe } = this.parts.rig.value;
    const length = pipe.segment_length_mm;
    this.parts.header.suggest({
      shape: pipe.shape === 'circular' ? 'circular' : 'rectangular',
      height_mm: pipe.shape === 'circular' ? pipe.diameter_mm : undefined,
      unit_length_m: length ? length / 1000 : undefined,
    });
  }

  /** After a reload only the person can open the file again, so name it. */
  #showUnfinished() {
    const waiting = this.#file ? [] : unfinishedUploads();
    const list = render(
      this.parts.unfinished,
      html`${waiting.map((upload, i) => html`<p class="message new__unfinished">${icon('info')}
        <span>${whatBecameOf(upload)}</span>
        <button type="button" class="button button--small" data-part="discard${i}">${t('new.discard')}</button></p>`)}`,
    );
    waiting.forEach((upload, i) => {
      list[`discard${i}`].addEventListener('click', async () => {
        await discardUpload(upload);
        this.#showUnfinished();
      });
    });
  }
}

const rememberedOf = (header) =>
  Object.fromEntries(Object.entries(header).filter(([name]) => REMEMBERED_FIELDS.has(name)));

function whatBecameOf({ name, size, whole, refused }) {
  const named = { name: html`<b>${name}</b>`, size: bytes(size) };
  if (refused) return pieces('new.refused', { ...named, reason: refused });
  return whole ? pieces('new.unused', named) : pieces('new.interrupted', named);
}

const kind = (value, sign, label, isChosen) => html`<label class="new__kind">
  <input type="radio" name="kind" value="${value}" ${isChosen && html`checked`} />${icon(sign)}<b>${label}</b></label>`;

customElements.define('new-inspection', NewInspection);
