/** New inspection: the video goes up while the header and the rig are filled in. */

import { ApiError, post, session } from '../../core/api.js';
import { html, render } from '../../core/html.js';
import { Component } from '../../core/store.js';
import { bytes, duration } from '../../core/units.js';
import { Upload, discardUpload, unfinishedUploads } from '../../core/upload.js';
import { icon } from '../icon/icon.js';
import '../rig-form/rig-form.js';

const REMEMBERED = 'chainage.header';
const ACCEPTED = 'video/*,.mp4,.mov,.m4v,.mkv,.avi,.mpg,.mpeg,.ts,.webm';

const HEADER_FIELDS = [
  ['asset_id', 'Asset', 'Number of the culvert or pipe'],
  ['start_node', 'Start node', 'Where the drive begins: headwall, manhole'],
  ['end_node', 'End node', 'Where it should end'],
  ['operator', 'Operator', ''],
  ['client', 'Client', ''],
];
const DIRECTIONS = [
  ['with_flow', 'With the flow'],
  ['against_flow', 'Against the flow'],
  ['unknown', 'Not known'],
];
const REFERENCE_POINTS = [
  'Inner face of the headwall at the start',
  'Centre of the start manhole',
  'Inner face of the wall at the start node',
  'End of the pipe inside the start node',
];

class NewInspection extends Component {
  #upload = null;
  #file = null;
  #isWanted = false;

  mount() {
    document.title = 'New inspection · Chainage';
    this.parts = render(
      this,
      html`<header class="topbar">
          <a class="brand" href="/">${icon('logo')}Chainage</a>
          <nav aria-label="Breadcrumb"><a class="button button--quiet" href="/">${icon('back')}Inspections</a></nav>
        </header>
        <main id="main" class="content new" tabindex="-1">
          <div class="content__head"><h1>New inspection</h1></div>
          <form class="new__form" data-part="form" novalidate>
            <section class="panel new__section" aria-labelledby="new-video">
              <h2 id="new-video">Video</h2>
              <div class="drop" data-part="drop">
                <div class="drop__ask" data-part="ask">
                  ${icon('film')}
                  <p>Drop the video of the drive here</p>
                  <button type="button" class="button" data-part="pick">Choose a file</button>
                  <p class="help">MP4, MOV, MKV, AVI, MPEG or WebM. The original is kept as it is.</p>
                </div>
                <div class="drop__file" data-part="chosen" hidden>
                  <p class="drop__name"><b data-part="fileName"></b> <span class="dim number" data-part="fileSize"></span></p>
                  <progress class="bar" data-part="bar" max="1" aria-label="Upload progress"></progress>
                  <p class="drop__state number" role="status" data-part="state"></p>
                  <div class="drop__buttons">
                    <button type="button" class="button button--small" data-part="pause"></button>
                    <button type="button" class="button button--small" data-part="cancel">Remove</button>
                  </div>
                </div>
                <input type="file" accept="${ACCEPTED}" data-part="input" hidden />
              </div>
              <div data-part="unfinished"></div>
              <p class="fault" role="alert" data-part="videoFault"></p>
            </section>

            <section class="panel new__section" aria-labelledby="new-header">
              <h2 id="new-header">What was inspected</h2>
              <div class="new__grid">
                <div class="field new__name">
                  <label for="new-name">Name</label>
                  <input class="input" id="new-name" maxlength="200" autocomplete="off" data-part="name"
                    aria-describedby="new-name-fault" />
                  <span class="fault" id="new-name-fault" data-part="nameFault"></span>
                </div>
                ${HEADER_FIELDS.map(([name, label, help]) => html`<div class="field">
                  <label for="new-${name}">${label}</label>
                  <input class="input" id="new-${name}" name="${name}" maxlength="200" autocomplete="off"
                    aria-describedby="new-${name}-help" />
                  <span class="help" id="new-${name}-help">${help}</span></div>`)}
                <div class="field">
                  <label for="new-direction">Direction</label>
                  <select class="input" id="new-direction" name="direction">
                    ${DIRECTIONS.map(([value, label]) => html`<option value="${value}">${label}</option>`)}
                  </select>
                </div>
                <div class="field new__name">
                  <label for="new-reference_point">Distance is counted from</label>
                  <input class="input" id="new-reference_point" name="reference_point" maxlength="200"
                    list="new-references" autocomplete="off" />
                  <datalist id="new-references">
                    ${REFERENCE_POINTS.map((point) => html`<option value="${point}"></option>`)}
                  </datalist>
                </div>
              </div>
            </section>

            <section class="panel new__section" aria-labelledby="new-rig">
              <h2 id="new-rig">Rig</h2>
              <rig-form data-part="rig"></rig-form>
            </section>

            <div class="new__foot">
              <p class="fault" role="alert" data-part="fault"></p>
              <button class="button button--primary" data-part="start">Start tracking</button>
            </div>
          </form>
        </main>`,
    );
    const { drop, input, pick, pause, cancel, form } = this.parts;
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
    // The log-in page is next: the question about leaving would stand in its way.
    this.listen(session, 'signed-out', () => this.#upload?.pause());
    this.#recall();
    this.#showUnfinished();
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

  /** Size of the picture, as far as this browser can open the file. */
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
    const percent = `${Math.floor(100 * share)} %`;
    const pace = speed ? ` · ${bytes(speed)}/s` : '';
    const left = etaS === null ? '' : ` · ${duration(etaS)} left`;
    this.parts.state.textContent = {
      IDLE: '',
      SENDING: `${percent} uploaded${pace}${left}`,
      WAITING: `${percent} uploaded · ${reason} Trying again…`,
      PAUSED: `${percent} uploaded · paused`,
      DONE: 'Uploaded',
      FAILED: reason,
      CANCELLED: '',
    }[state];
    const isStopped = state === 'PAUSED' || state === 'FAILED';
    this.parts.pause.textContent = isStopped ? 'Go on' : 'Pause';
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
    this.parts.videoFault.textContent = this.#upload ? '' : 'Choose the video first.';
    const isNamed = this.#checkName();
    const isRigGood = this.parts.rig.check();
    if (!this.#upload) this.parts.pick.focus();
    else if (!isNamed) this.parts.name.focus();
    if (!this.#upload || !isNamed || !isRigGood) return;
    this.#want(true);
    if (this.#upload.state === 'DONE') this.#create();
    else if (this.#upload.state === 'PAUSED' || this.#upload.state === 'FAILED') this.#upload.start();
  }

  #checkName() {
    const isNamed = this.parts.name.value.trim() !== '';
    this.parts.nameFault.textContent = isNamed ? '' : 'Needed: it is what the list shows.';
    this.parts.name.setAttribute('aria-invalid', String(!isNamed));
    return isNamed;
  }

  /** Whether tracking is to start as soon as the upload is complete. */
  #want(isWanted) {
    this.#isWanted = isWanted;
    this.parts.start.disabled = isWanted;
    this.parts.start.textContent = isWanted ? 'Starts when the upload is complete…' : 'Start tracking';
  }

  async #create() {
    this.#isWanted = false;
    const header = this.#header();
    this.#remember(header);
    try {
      const { id } = await post('/api/inspections', {
        name: this.parts.name.value.trim(),
        source: { kind: 'upload', upload_id: this.#upload.id },
        rig: this.parts.rig.value,
        header,
      });
      this.#upload.forget();
      location.assign(`/inspections/${id}`);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      this.parts.fault.textContent = error.message;
      this.#want(false);
    }
  }

  #header() {
    const entries = [...new FormData(this.parts.form)].map(([name, value]) => [name, value.trim()]);
    return Object.fromEntries(entries.filter(([, value]) => value));
  }

  #remember(header) {
    localStorage.setItem(REMEMBERED, JSON.stringify(header));
    this.parts.rig.remember();
  }

  #recall() {
    const header = JSON.parse(localStorage.getItem(REMEMBERED) ?? '{}');
    for (const [name, value] of Object.entries(header)) {
      const field = this.parts.form.elements.namedItem(name);
      if (field) field.value = value;
    }
  }

  /** After a reload: a file can only be opened again by the person, so say which one. */
  #showUnfinished() {
    const waiting = this.#file ? [] : unfinishedUploads();
    const list = render(
      this.parts.unfinished,
      html`${waiting.map((upload, i) => html`<p class="message new__unfinished">${icon('info')}
        <span>The upload of <b>${upload.name}</b> (${bytes(upload.size)}) was interrupted. Choose the same file
          again and it goes on where it stopped.</span>
        <button type="button" class="button button--small" data-part="discard${i}">Discard</button></p>`)}`,
    );
    waiting.forEach((upload, i) => {
      list[`discard${i}`].addEventListener('click', async () => {
        await discardUpload(upload);
        this.#showUnfinished();
      });
    });
  }
}

customElements.define('new-inspection', NewInspection);
