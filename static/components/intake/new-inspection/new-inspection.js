/**
 * New inspection: films are uploaded while the header and the rig are filled in, or a camera is chosen. Each of
 * several films becomes an inspection, with the same header and rig.
 */

import { ApiError, get, poll, post, refusalIn, remove, session, takePicture } from '../../../core/server/api.js';
import { newestOf, offered, projectOf } from '../../../core/defects/packs.js';
import { html, render, setText } from '../../../core/page/html.js';
import { preferences } from '../../../core/page/preferences.js';
import { recall, remember } from '../../../core/page/remembered.js';
import { Component } from '../../../core/page/store.js';
import { date } from '../../../core/wall/units.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { topBar } from '../../shared/top-bar/top-bar.js';
import '../film-picker/film-picker.js';
import '../../desk/header/header-form.js';
import '../rig-form/rig-form.js';
import '../rig-wizard/rig-wizard.js';
import '../source-picker/source-picker.js';
import { FIELD_OF, headerOf, pipeOf } from './pipe.js';

const REMEMBERED = 'chainage.header';

/** Fields known only after the survey, or filled in by the program. */
const NOT_YET = new Set(['end_condition', 'abandon_reason', 'video_files']);
/** People, who are proposed for the next inspection. Other fields belong to the asset, the day or the camera. */
const OF_PEOPLE = [
  'client',
  'contractor',
  'operator',
  'operator_certificate',
  'reviewer',
  'method',
  'standard',
  'edition',
];
/** Equipment, which comes back with its camera. */
const OF_THE_CAMERA = ['calibration_id', 'camera', 'lens', 'camera_offset_m', 'tether'];
const ASK_CAMERA_EVERY_S = 0.3;
const STANDARD = { standard: 'EN 13508-2', edition: '2003+A1:2011' };

export class NewInspection extends Component {
  /** The film whose picture size is compared with the rig's. */
  #measured = null;
  /** Id of the upload that the server was asked about. */
  #described = null;
  /** The name that was proposed after a film. */
  #proposed = null;
  /** Ends the wait for the camera's first picture; null while there is no wait. */
  #connecting = null;

  mount() {
    document.title = t('new.page');
    /** @type {Parts<'new-inspection/new-inspection'>} */
    this.parts = render(
      this,
      html`${topBar()}
        <main id="main" class="content new" tabindex="-1">
          <div class="content__head"><h1>${t('new.title')}</h1></div>
          <form class="stack gap-4" data-part="form" data-needs="operator" novalidate>
            <section class="panel new__section stack gap-4 one-column" aria-labelledby="new-video">
              <h2 id="new-video">${t('new.video')}</h2>
              <fieldset class="new__kinds stack" data-part="kinds">
                <legend class="visually-hidden">${t('new.kind')}</legend>
                ${kind('upload', 'film', t('new.kind_file'), true)}
                ${kind('live', 'live', t('new.kind_live'), false)}
              </fieldset>
              <source-picker class="stack gap-3" data-part="camera" hidden></source-picker>
              <film-picker class="stack" data-part="picker"></film-picker>
              <p class="fault" role="alert" data-part="videoFault"></p>
            </section>

            <section class="panel new__section stack gap-4 one-column" aria-labelledby="new-header">
              <h2 id="new-header">${t('new.what')}</h2>
              <p class="help" data-part="namedAlike" hidden>${t('new.named_after_files')}</p>
              <div class="field" data-part="nameField">
                <label for="new-name">${t('new.name')}</label>
                <input class="input" id="new-name" maxlength="200" autocomplete="off" data-part="name"
                  aria-describedby="new-name-fault" />
                <span class="fault" id="new-name-fault" data-part="nameFault"></span>
              </div>
              <header-form data-part="header"></header-form>
            </section>

            <section class="panel new__section stack gap-4 one-column" aria-labelledby="new-rig">
              <h2 id="new-rig">${t('new.rig')}</h2>
              <rig-wizard class="stack one-column" data-part="wizard"></rig-wizard>
              <div class="row gap-3 wrap" data-part="test" hidden>
                <button type="button" class="button" data-part="look">${icon('video')}${t('source.test')}</button>
                <span class="help" role="status" data-part="looked">${t('source.test_help')}</span></div>
              <rig-form data-part="rig"></rig-form>
            </section>

            <div class="new__foot row gap-3 wrap">
              <p class="fault" role="alert" data-part="fault"></p>
              <button type="button" class="button" data-part="stop" hidden>${t('page.cancel')}</button>
              <button class="button button--primary" data-part="start">${t('new.start')}</button>
            </div>
          </form>
        </main>`,
    );
    const { picker, form } = this.parts;
    this.parts.header.without = NOT_YET;
    this.parts.wizard.rig = this.parts.rig;
    this.listen(this.parts.kinds, 'change', () => this.#showKind());
    this.listen(this.parts.camera, 'source', () => (this.parts.rig.video = null));
    this.listen(this.parts.look, 'click', () => this.#look());
    this.listen(this.parts.stop, 'click', () => this.#connecting?.abort());
    this.listen(picker, 'films', () => this.#showFilms());
    this.listen(picker.queue, 'change', () => {
      this.#showStart();
      this.#showWizard();
    });
    this.listen(picker.queue, 'end', () => this.#leave());
    this.listen(this.parts.name, 'input', () => this.#checkName());
    this.listen(form, 'submit', (event) => {
      event.preventDefault();
      this.#submit();
    });
    this.listen(window, 'beforeunload', (event) => {
      if (picker.queue.sending) event.preventDefault();
    });
    // The log-in page is next: the question about leaving would be in its way.
    this.listen(session, 'signed-out', () => picker.queue.pause());
    const { header, rig } = this.parts;
    for (const type of ['field', 'suggested']) this.listen(header, type, () => this.#statePipe());
    this.listen(rig, 'pipe', ({ detail }) => this.#takePipe(detail));
    this.listen(rig, 'elsewhere', ({ detail: { path, reason } }) => {
      header.fault(FIELD_OF[path], reason);
      header.goTo(FIELD_OF[path]);
    });
    this.listen(rig, 'again', ({ detail }) => header.suggest(detail));
    this.listen(rig, 'named', ({ detail }) => header.suggest({ rig_id: detail || null }));
    this.listen(this.parts.wizard, 'shown', ({ detail }) => this.parts.header.propose(detail));
    this.#recall();
    this.#showFilms();
    this.#showWizard();
    const asked = new URLSearchParams(location.search);
    const [asset, order] = [asked.get('asset'), asked.get('order')];
    if (asset) this.#begin(asset);
    if (order) this.parts.header.enter('client_job_ref', order);
  }

  /** Begins with a section of the register: its id fills in what is known of it. */
  #begin(asset) {
    this.parts.name.value = asset;
    this.parts.header.enter('asset_id', asset);
  }

  get #queue() {
    return this.parts.picker.queue;
  }

  get #isLive() {
    return this.parts.kinds.querySelector(':checked').value === 'live';
  }

  #showKind() {
    const isLive = this.#isLive;
    const { camera, picker, wizard, name, rig, videoFault } = this.parts;
    camera.hidden = this.parts.test.hidden = !isLive;
    wizard.hidden = isLive;
    picker.hidden = isLive;
    videoFault.textContent = '';
    this.#queue.stopMaking();
    this.#measured = rig.video = null;
    if (isLive && !name.value) name.value = t('new.live_name', { time: date(new Date()) });
    this.#showFilms();
  }

  /** Shows a picture of the camera with the lines of the rig, before anything is recorded. */
  async #look() {
    const { camera, rig, look, looked } = this.parts;
    if (!camera.check()) return;
    look.disabled = true;
    setText(looked, t('live.connecting'));
    const { width, height } = rig.value.camera;
    try {
      const picture = await takePicture({ url: camera.value, ...(width && height && { width, height }) }, this.signal);
      const { width: across, height: down } = await createImageBitmap(picture);
      rig.video = { width: across, height: down };
      rig.picture = URL.createObjectURL(picture);
      setText(looked, t('source.tested', { width: across, height: down }));
    } catch (error) {
      const refusal = refusalIn(error);
      if (!refusal) return;
      setText(looked, '');
      camera.fault(errorText(refusal));
    }
    look.disabled = false;
  }

  #showFilms() {
    const { name, nameField, namedAlike, picker, videoFault } = this.parts;
    const { films } = this.#queue;
    const isMany = films.length > 1 && !this.#isLive;
    nameField.hidden = isMany;
    namedAlike.hidden = !isMany;
    if (films.length) videoFault.textContent = '';
    if (films.length === 1 && (!name.value || name.value === this.#proposed)) {
      [this.#proposed] = picker.names;
      name.value = this.#proposed;
      this.#checkName();
    }
    this.#measure(this.#isLive ? null : (films[0]?.file ?? null));
    this.#showStart();
  }

  /** Wizard and rig show the first film that has arrived. */
  #showWizard() {
    const { films } = this.#queue;
    const arrived = films.find(({ upload, inspection }) => upload.state === 'DONE' && !inspection);
    this.parts.wizard.film = arrived ? `/api/uploads/${arrived.upload.id}` : null;
    this.parts.rig.picture = arrived ? `/api/uploads/${arrived.upload.id}/picture` : null;
    if (arrived && arrived.upload.id !== this.#described) this.#describe(arrived.upload.id);
  }

  /** Tells the rig what the film states. A film that the server cannot read is refused with a reason later. */
  async #describe(id) {
    this.#described = id;
    try {
      const film = await get(`/api/uploads/${id}/axis`, this.signal);
      if (id === this.#described) this.parts.rig.video = film;
    } catch (error) {
      if (error.name !== 'AbortError' && !(error instanceof ApiError)) throw error;
    }
  }

  /** Compares the picture size of a film with the rig's, if this browser can open the file. */
  #measure(file) {
    if (file === this.#measured) return;
    this.#measured = file;
    this.parts.rig.video = null;
    if (!file) return;
    const video = document.createElement('video');
    const url = URL.createObjectURL(file);
    const finish = (size) => {
      video.onloadeddata = video.onerror = null;
      video.removeAttribute('src'); // it would read on
      video.load();
      URL.revokeObjectURL(url);
      if (this.#measured === file) this.parts.rig.video = size;
    };
    video.preload = 'auto';
    video.onloadeddata = () => finish(sizeOf(video));
    video.onerror = () => finish(null);
    video.src = url;
  }

  #submit() {
    this.parts.fault.textContent = '';
    const isMany = this.parts.nameField.hidden;
    const isNamed = isMany || this.#checkName();
    const isRigGood = this.parts.rig.check();
    if (this.#isLive) {
      if (!isNamed) this.parts.name.focus();
      if (this.parts.camera.check() && isNamed && isRigGood) this.#connect();
      return;
    }
    const hasFilm = this.#queue.films.some(({ inspection }) => !inspection);
    this.parts.videoFault.textContent = hasFilm ? '' : t('new.choose_first');
    if (!hasFilm) this.parts.picker.focus();
    else if (!isNamed) this.parts.name.focus();
    if (hasFilm && isNamed && isRigGood) this.#make();
  }

  /** Makes an inspection of each film, with what the form says now. */
  #make() {
    const { picker, name, header, rig, fault, wizard } = this.parts;
    const { counter } = wizard;
    const stated = { rig: rig.value, header: header.value, ...(counter && { counter }) };
    this.#remember(stated.header, name.value.trim());
    this.#queue.makeWith(async (film) => {
      const { films } = this.#queue;
      const title = films.length === 1 ? name.value.trim() : picker.names[films.indexOf(film)];
      const source = { kind: 'upload', upload_id: film.upload.id };
      try {
        return (await post('/api/inspections', { name: title, source, ...stated })).id;
      } catch (error) {
        // It would be refused for each film.
        if (['invalid_rig', 'no_wall_in_view'].includes(error.code)) {
          this.#queue.stopMaking();
          fault.textContent = errorText(error);
        }
        throw error;
      }
    });
  }

  /** Opens what has been made, or says what has failed. */
  #leave() {
    const { films } = this.#queue;
    if (!films.length) return;
    const failed = films.filter(({ inspection }) => !inspection);
    if (!failed.length) {
      location.assign(films.length === 1 ? `/inspections/${films[0].inspection}` : '/inspections');
    } else if (films.length === 1) this.parts.fault.textContent = failed[0].refused ?? failed[0].upload.reason;
    else this.parts.fault.textContent = t('new.some_failed', { n: failed.length, made: films.length - failed.length });
  }

  #checkName() {
    const isNamed = this.parts.name.value.trim() !== '';
    this.parts.nameFault.textContent = isNamed ? '' : t('new.name_needed');
    this.parts.name.setAttribute('aria-invalid', String(!isNamed));
    return isNamed;
  }

  /** Shows what the button does, or what it waits for; nothing can be started meanwhile. */
  #showStart() {
    const waiting = this.#connecting ? t('live.connecting') : this.#queue.isMaking ? t('new.starts_later') : '';
    this.parts.start.disabled = waiting !== '';
    setText(this.parts.start, waiting || (this.#isLive ? t('new.record') : t('new.start')));
  }

  /** Starts the camera and opens its page when it delivers pictures; otherwise deletes the inspection. */
  async #connect() {
    const { camera, stop, fault } = this.parts;
    this.#connecting = new AbortController();
    this.#showStart();
    stop.hidden = false;
    try {
      const stated = { rig: this.parts.rig.value, header: this.parts.header.value };
      this.#remember(stated.header, this.parts.name.value.trim());
      const source = { kind: 'live', url: camera.value };
      const { id } = await post('/api/inspections', { name: this.parts.name.value.trim(), source, ...stated });
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
    this.#showStart();
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
      rig.video = { width: Number(size[1]), height: Number(size[2]) };
      rig.check();
    } else camera.fault(errorText(error));
  }

  #remember(header, title) {
    remember(REMEMBERED, only([...OF_PEOPLE, 'code_pack'], header));
    this.parts.rig.remember(title, only(OF_THE_CAMERA, header));
  }

  /** Suggests the people of the last inspection, the present time, and a round pipe; offers the last camera. */
  #recall() {
    const { header, rig } = this.parts;
    const now = new Date();
    const digits = (number) => String(number).padStart(2, '0');
    header.suggest({
      shape: 'circular',
      ...STANDARD,
      date: `${now.getFullYear()}-${digits(now.getMonth() + 1)}-${digits(now.getDate())}`,
      time: `${digits(now.getHours())}:${digits(now.getMinutes())}`,
      ...only(OF_PEOPLE, recall(REMEMBERED, {})),
    });
    rig.offerLast();
    this.#suggestPack();
  }

  /** Suggests the newest version of the pack of the last inspection, else of the settings. */
  async #suggestPack() {
    try {
      const { packs } = await get('/api/packs');
      const { header } = this.parts;
      /** @type {{code_pack?: string}} */
      const last = recall(REMEMBERED, {});
      const newest = newestOf(packs, last.code_pack ?? preferences.value.pack);
      if (newest && offered(packs, projectOf(header.all)).includes(newest)) header.suggest({ code_pack: newest.id });
    } catch (error) {
      refusalIn(error); // without the list the built-in codes are offered
    }
  }

  /** Gives the rig the pipe of the header. */
  #statePipe() {
    this.parts.rig.pipe = pipeOf(this.parts.header.all);
  }

  /** A size that a person types into the rig is that of the header; what a file or preset says only fills what is empty. */
  #takePipe({ values, isTyped }) {
    const { header } = this.parts;
    const { shape, ...sizes } = headerOf(values);
    header.suggest({ shape });
    if (isTyped) header.state(only(Object.keys(sizes), sizes));
    else header.suggest(sizes);
  }
}

/** Returns the filled ones of some fields. */
const only = (names, header) =>
  Object.fromEntries(names.map((name) => [name, header[name]]).filter(([, value]) => (value ?? '') !== ''));

const kind = (value, sign, label, isChosen) => html`<label class="new__kind row tile pad-row">
  <input type="radio" name="kind" value="${value}" ${isChosen && html`checked`} />${icon(sign)}<b>${label}</b></label>`;

/**
 * Returns the size of a video in its own pixels; that of square pixels, until the server has the film, where a browser
 * tells no more: VideoFrame exists over https and on localhost, and a busy browser may not have drawn a picture yet.
 */
function sizeOf(video) {
  const { videoWidth: width, videoHeight: height } = video;
  const own = ownSize(video);
  if (!own) return { width, height };
  const isTurned = own.width > own.height !== width > height;
  return isTurned ? { width: own.height, height: own.width } : { width: own.width, height: own.height };
}

function ownSize(video) {
  if (!('VideoFrame' in globalThis)) return null;
  try {
    const picture = new VideoFrame(video);
    const own = picture.visibleRect;
    picture.close();
    return own;
  } catch (error) {
    if (error.name === 'InvalidStateError') return null;
    throw error;
  }
}

customElements.define('new-inspection', NewInspection);
