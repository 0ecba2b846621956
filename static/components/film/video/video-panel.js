/**
 * The picture with its overlay, the transport and the quick codes.
 *
 * Two modes: LIVE (pictures of the running tracker) => REVIEW (any tracked frame) on the first seek
 * or when tracking ends; REVIEW => LIVE by the Live button while tracking runs.
 */

import { html, render, setText } from '../../../core/page/html.js';
import { hasFilm } from '../../../core/survey/inspection.js';
import { withKey } from '../../../core/page/keys.js';
import { squareOf, stretchOf, toSquare } from '../../../core/wall/pixels.js';
import { onThemeChange, sharpContext, typeScale } from '../../../core/page/screen.js';
import { Component } from '../../../core/page/store.js';
import { timecode } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { drawSeverity } from '../../shared/severity-mark/severity-mark.js';
import '../../defects/code-chain/code-chain.js';
import { icon } from '../../shared/icon/icon.js';
import { paintOnPicture } from '../measure/on-picture.js';
import { Marks } from './marks.js';
import { MARK_PX, paintCentre, paintLabel, paintRing, placeOf } from './overlay-drawing.js';
import './quick-buttons.js';
import { paintFinding } from './finding-on-film.js';
import { filmGestures } from './film-gestures.js';
import { FilmView, layoutOf, transformOf } from './film-view.js';
import './picture-age.js';
import './picture-look.js';
import { BlankPlayer, FilePlayer, LivePlayer, StillPlayer } from './players.js';
import { SPEEDS, besideSpeed } from './speeds.js';
import { atPointer, whyNoPicture } from './words-on-film.js';
import { toastError } from '../../shared/toast-stack/toast-stack.js';

const ZOOM_STEP = 1.5;
const PAN_PX = 60;
/** Room of one label, across and down: more labels would overlap. */
const LABEL_ROOM = [56, 24];
/** What is written at the pointer stands as much higher. */
const POINTER_ROOM = 26;
const BUSY_SHOWN_AFTER_MS = 250;

export class VideoPanel extends Component {
  #player = null;
  #playerEnd = null;
  #mode = null;
  #cursor = null;
  #view = new FilmView();
  /** Speed of playing, one of SPEEDS. */
  #speed = 1;
  #busySince = 0;
  #marks;
  /** Id of the run whose track is shown. */
  #run = null;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.#marks = new Marks(this.desk);
    const { video } = this.desk.inspection.value;
    /** @type {Parts<'video/video-panel'>} */
    this.parts = render(
      this,
      html`<div class="stage" data-part="stage">
          <div class="stage__film">
            <video class="covers" data-part="video" muted playsinline preload="auto" tabindex="-1" aria-hidden="true"></video>
            <canvas data-part="picture" class="stage__picture covers" role="img" aria-label="${t('video.picture')}"></canvas>
          </div>
          <canvas data-part="overlay" class="stage__overlay covers" aria-hidden="true"></canvas>
          <p class="stage__badge on-film row small strong" data-part="badge" hidden>${icon('live')}${t('video.live')}
            <picture-age class="stage__age row"></picture-age></p>
          <p class="stage__note on-film unless-empty" data-part="note"></p>
          <code-chain class="stack one-column pad-3" data-part="chain"></code-chain>
          <div class="stage__tools flow gap-1" role="group" aria-label="${t('video.view')}">
            ${tool('zoomOut', 'minus', t('video.zoom_out'), 'O')}
            <button class="button button--small stage__tool number" data-part="whole" disabled
              title="${withKey(t('video.whole'), 'W')}"></button>
            ${tool('zoomIn', 'plus', t('video.zoom_in'), 'I')}
            <picture-look></picture-look>
            ${tool('large', 'large', t('video.large'), 'Shift + F')}
          </div>
        </div>
        <div class="transport row gap-3">
          <div class="flow gap-1">
            ${button('stepBack', 'stepBack', t('video.back'), '←')}
            ${button('play', 'play', t('video.play'), t('video.space'))}
            ${button('stepForward', 'stepForward', t('video.forward'), '→')}
          </div>
          <input class="transport__time grow" type="range" min="0" max="1" step="any" value="0" data-part="time"
            aria-label="${t('video.time')}" />
          <p class="transport__clock small dim nowrap number"><span data-part="clock"></span><span class="transport__frame"
            data-part="frame"></span></p>
          <select class="input transport__speed" data-part="speed" aria-label="${t('video.speed')}"
            title="${t('video.speed_keys')}">${SPEEDS.map((speed) => html`<option value="${speed}">${speed}×</option>`)}</select>
          <button class="button button--small" data-part="live" aria-pressed="false"
            title="${t('video.follow')}">${icon('live')}${t('video.live')}</button>
        </div>
        <quick-buttons class="quick stack gap-1" role="group" aria-label="${t('video.quick')}" data-needs="operator"></quick-buttons>`,
    );
    const { parts, desk } = this;
    const square = this.#square;
    parts.stage.style.setProperty('--aspect', `${square.width} / ${square.height}`);
    Object.assign(parts.picture, square);

    this.listen(parts.stepBack, 'click', () => this.step(-1));
    this.listen(parts.stepForward, 'click', () => this.step(1));
    this.listen(parts.play, 'click', () => this.togglePlay());
    this.listen(parts.live, 'click', () => this.#enter('LIVE'));
    this.listen(parts.time, 'input', () => this.seek(desk.track.frameAt(Number(parts.time.value))));
    // After a click the keyboard focus returns to the film.
    this.listen(this, 'mousedown', (event) => {
      if (event.target.closest('button')) event.preventDefault();
    });
    this.listen(parts.time, 'pointerup', () => parts.time.blur());
    this.listen(parts.zoomIn, 'click', () => this.zoom(1));
    this.listen(parts.zoomOut, 'click', () => this.zoom(-1));
    this.listen(parts.whole, 'click', () => this.#view.showWhole());
    this.listen(parts.large, 'click', () => desk.large.toggle('film'));
    this.listen(parts.speed, 'change', () => {
      this.#setSpeed(Number(parts.speed.value));
      parts.speed.blur();
    });
    this.listen(desk.large, 'change', () => this.#showLarge());
    filmGestures(parts.overlay, this.#view, () => [this.#size(), video], this.signal);
    this.listen(this.#view, 'change', () => this.repaint());
    this.listen(parts.overlay, 'pointermove', (event) => this.#point(event));
    this.listen(parts.overlay, 'pointerleave', () => this.#point(null));
    this.listen(parts.overlay, 'click', (event) => this.#click(event));
    const { playhead, selection, observations, measuring, findings, tab } = desk;
    const drawn = [playhead, selection, observations, measuring, findings, findings.current, tab];
    this.listen(drawn, 'change', () => this.repaint());
    this.listen(desk.track, 'change', () => this.#tracked());
    this.listen(desk.inspection, 'change', () => this.#stateChanged());
    this.listen(desk.live, 'message', ({ detail }) => this.#ended(detail.header));
    onThemeChange(() => this.repaint(), this.signal);
    const resized = new ResizeObserver(() => this.repaint());
    resized.observe(parts.stage);
    this.signal.addEventListener('abort', () => {
      resized.disconnect();
      this.#leave();
    });
    parts.speed.value = this.#speed;
    this.#enter(desk.inspection.isUnfinished ? 'LIVE' : 'REVIEW');
  }

  /** Shows a tracked frame. */
  seek(frame) {
    if (!this.#review()) return;
    this.#player.shuttle(0);
    this.#ask(frame);
  }

  step(count) {
    if (this.#review()) this.#wish(() => this.#player.step(count));
  }

  skip(seconds) {
    if (this.#review()) this.#wish(() => this.#player.skip(seconds));
  }

  togglePlay() {
    if (!this.#review()) return;
    const isAtEnd = this.#player.asked >= this.desk.track.length - 1;
    if (this.#player.rate === 0 && isAtEnd) this.#ask(0);
    this.#player.shuttle(this.#player.rate === 0 ? this.#speed : 0);
  }

  /** J, K, L: backwards, stop, forwards; again is faster. */
  shuttle(direction) {
    if (!this.#review()) return;
    const { rate } = this.#player;
    const isSame = direction !== 0 && Math.sign(rate) === direction;
    this.#player.shuttle(direction * (isSame ? besideSpeed(Math.abs(rate), 1) : this.#speed));
  }

  /** Plays slower (-1) or faster (1) from now on. */
  changeSpeed(direction) {
    this.#setSpeed(besideSpeed(this.#speed, direction));
  }

  #setSpeed(speed) {
    this.#speed = speed;
    this.parts.speed.value = speed;
    const { rate } = this.#player;
    if (this.#mode === 'REVIEW' && rate !== 0) this.#player.shuttle(Math.sign(rate) * speed);
  }

  /** Enlarges the picture (1) or makes it smaller (-1), about its middle. */
  zoom(direction) {
    const size = this.#size();
    const [x, y] = size.map((length) => length / 2);
    this.#view.zoomAt(ZOOM_STEP ** direction, x, y, size, this.#square);
  }

  /** Moves an enlarged picture: 1 shows what lies right of it, or below. */
  pan(across, down) {
    this.#view.move(-PAN_PX * across, -PAN_PX * down, this.#size(), this.#square);
  }

  /** Begins a code with the letter that was pressed. */
  typeCode(letter) {
    this.parts.chain.open(letter);
  }

  showWhole() {
    this.#view.showWhole();
  }

  /** Enters REVIEW if anything is tracked. */
  #review() {
    if (this.desk.track.length === 0) return false;
    if (this.#mode !== 'REVIEW') this.#enter('REVIEW');
    return true;
  }

  #wish(move) {
    move();
    this.#busySince = performance.now();
    this.repaint();
  }

  /** Requests the tracked frame nearest to the wanted one: the last live picture can be ahead of the track. */
  #ask(frame) {
    const tracked = Math.min(Math.max(frame, 0), this.desk.track.length - 1);
    this.#wish(() => this.#player.seek(tracked));
  }

  #leave() {
    this.#playerEnd?.abort();
    this.#player?.close();
    this.#player = null;
  }

  /** LIVE <=> REVIEW */
  #enter(mode) {
    // What was asked for last is still wanted, if another player is to show it.
    const wished = this.#mode === 'REVIEW' ? this.#player.asked : -1;
    const from = wished < 0 ? this.desk.playhead.value.frame : wished;
    this.#leave();
    this.#mode = mode;
    this.#player = this.#makePlayer(mode);
    this.#playerEnd = new AbortController();
    const { signal } = this.#playerEnd;
    this.#player.addEventListener('frame', () => this.#shown(), { signal });
    this.#player.addEventListener('state', () => this.#showTransport(), { signal });
    this.#player.addEventListener('unplayable', () => this.#useStills(), { signal });
    if (mode === 'REVIEW' && this.desk.track.length) this.#ask(from);
    this.#showTransport();
    this.repaint();
  }

  #makePlayer(mode) {
    const { desk, parts } = this;
    const { video } = desk.inspection.value;
    if (mode === 'LIVE') return new LivePlayer(parts.picture, desk.live, squareOf(video));
    if (!hasFilm(desk.inspection.value)) return new BlankPlayer(parts.picture, desk.track);
    const path = `/api/inspections/${desk.inspection.id}`;
    return this.#isPlayable
      ? new FilePlayer(parts.picture, desk.track, parts.video, path, squareOf(video))
      : new StillPlayer(parts.picture, desk.track, path);
  }

  get #isPlayable() {
    return this.desk.inspection.value.video.playable && !this.isUnplayable;
  }

  #useStills() {
    this.isUnplayable = true;
    this.#enter('REVIEW');
  }

  #shown() {
    const { frame } = this.#player;
    const isLive = this.#mode === 'LIVE';
    const row = isLive ? this.#player.row : this.desk.track.row(frame);
    const capturedMs = isLive ? this.#player.capturedMs : null;
    this.desk.playhead.set({ frame, row, isLive, capturedMs });
    this.#showTime();
  }

  /**
   * Handles the first rows of a finished track, or of one that is reviewed before it has any picture; and
   * another run, which has not reached the shown frame.
   */
  #tracked() {
    const { track, inspection } = this.desk;
    const isOfAnotherRun = track.run !== this.#run;
    this.#run = track.run;
    if (isOfAnotherRun && this.#mode === 'REVIEW' && this.#player.asked >= track.length) {
      this.#enter(inspection.isUnfinished ? 'LIVE' : 'REVIEW');
    }
    if (this.#mode === 'REVIEW' && this.#player.asked < 0 && track.length) this.#ask(0);
    this.#showTime();
    this.repaint();
  }

  #stateChanged() {
    if (this.desk.inspection.isUnfinished) {
      if (this.#mode === 'REVIEW' && this.desk.track.length === 0) this.#enter('LIVE');
    } else if (
      this.#mode === 'LIVE' ||
      (hasFilm(this.desk.inspection.value) && this.#isPlayable !== this.#player instanceof FilePlayer)
    ) {
      this.#enter('REVIEW'); // a camera's recording is a film once it has ended
    }
    this.#showTransport();
    this.repaint();
  }

  #ended({ state }) {
    if (state === this.desk.inspection.value.status) return;
    this.desk.inspection.load().catch(toastError);
  }

  #showTransport() {
    const { parts, desk } = this;
    const isPlaying = this.#player.rate !== 0;
    const isLive = this.#mode === 'LIVE';
    const label = isPlaying ? t('video.pause') : t('video.play');
    if (parts.play.dataset.shows !== label) {
      parts.play.dataset.shows = label;
      render(parts.play, icon(isPlaying ? 'pause' : 'play'));
      parts.play.setAttribute('aria-label', label);
      parts.play.title = t('video.with_key', { what: label, key: t('video.space') });
    }
    parts.badge.hidden = !(isLive && desk.inspection.isUnfinished);
    parts.live.setAttribute('aria-pressed', String(isLive));
    parts.live.classList.toggle('transport__live--off', !desk.inspection.isUnfinished);
    parts.live.disabled = !desk.inspection.isUnfinished;
    this.#showTime();
  }

  #showTime() {
    const { parts, desk } = this;
    const { video } = desk.inspection.value;
    const last = desk.track.row(desk.track.length - 1);
    const stated = desk.inspection.isUnfinished ? (video.duration_s ?? 0) : 0;
    const end = Math.max(stated, last?.time_s ?? 0);
    const { frame, row } = desk.playhead.value;
    const now = row?.time_s ?? 0;
    parts.time.max = end || 1;
    parts.time.value = now;
    parts.time.disabled = !last;
    const number = frame < 0 ? '–' : frame;
    parts.time.setAttribute('aria-valuetext', `${timecode(now)}, ${t('video.frame', { frame: number })}`);
    parts.clock.textContent = `${timecode(now)} / ${timecode(end, 0)}`;
    parts.frame.textContent = ` · ${t('video.frame', { frame: number })}`;
  }

  // The overlay -------------------------------------------------------------------------------

  /** The size of the stage, in as many CSS px. @returns {[number, number]} */
  #size(unit = 1) {
    return [this.parts.stage.clientWidth / unit, this.parts.stage.clientHeight / unit];
  }

  /**
   * Returns where the picture lies within the stage: its corner, and the size of a square px.
   * @param {number} unit of the result, in CSS px
   */
  #layout(unit = 1) {
    return layoutOf(this.#size(unit), this.#square, this.#view.value);
  }

  get #square() {
    return squareOf(this.desk.inspection.value.video);
  }

  /** Pixel centres are integers, so the picture's corner is at (-0.5, -0.5). @returns {[number, number]|null} */
  #toPixel(event) {
    const { left, top, scale } = this.#layout();
    const { video } = this.desk.inspection.value;
    const { width, height } = video;
    const [across, down] = stretchOf(video);
    const u = (event.offsetX - left) / (across * scale) - 0.5;
    const v = (event.offsetY - top) / (down * scale) - 0.5;
    return u >= -0.5 && v >= -0.5 && u <= width - 0.5 && v <= height - 0.5
      ? [Math.min(Math.max(u, 0), width - 1), Math.min(Math.max(v, 0), height - 1)]
      : null;
  }

  #point(event) {
    this.#cursor = event && hasFilm(this.desk.inspection.value) ? this.#toPixel(event) : null;
    this.repaint();
  }

  #click(event) {
    const pixel = this.#toPixel(event);
    if (!pixel || !hasFilm(this.desk.inspection.value)) return;
    const { value: pick } = this.desk.picking;
    const mark = this.#markAt(pixel);
    if (pick) pick({ frame: this.desk.playhead.value.frame, pixel });
    else if (mark) this.desk.select(mark.id);
    else this.desk.tag({ pixel });
  }

  #markAt(pixel) {
    return this.#marks.at(pixel, this.#layout(typeScale()).scale);
  }

  /** Shows the part of the picture that was chosen; the overlay draws itself where that is. */
  #showView() {
    const { parts } = this;
    const transform = transformOf(this.#size(), this.#square, this.#view.value);
    if (parts.picture.style.transform !== transform) {
      parts.picture.style.transform = parts.video.style.transform = transform;
    }
    setText(parts.whole, `${Math.round(100 * this.#view.value.zoom)} %`);
    parts.whole.disabled = parts.zoomOut.disabled = this.#view.isWhole;
    parts.stage.classList.toggle('stage--part', !this.#view.isWhole);
  }

  #showLarge() {
    const { large } = this.parts;
    const isLarge = this.desk.large.value === 'film';
    const label = isLarge ? t('video.small') : t('video.large');
    render(large, icon(isLarge ? 'small' : 'large'));
    large.setAttribute('aria-label', label);
    large.title = withKey(label, 'Shift + F');
  }

  paint() {
    const { parts, desk } = this;
    this.#showView();
    const type = typeScale();
    const context = sharpContext(parts.overlay, type);
    const layout = this.#layout(type);
    const { video } = desk.inspection.value;
    /** @returns {[number, number]} */
    const toStage = (pixel) => {
      const [x, y] = toSquare(video, pixel);
      return [layout.left + (x + 0.5) * layout.scale, layout.top + (y + 0.5) * layout.scale];
    };
    const styles = getComputedStyle(this);
    this.#paintNote();
    if (!desk.playhead.value.row || !hasFilm(desk.inspection.value)) return;
    if (desk.aim) paintCentre(context, toStage(desk.aim));
    const labelled = new Set();
    for (const mark of this.#marks.inPicture(layout.scale)) {
      const [x, y] = toStage(mark.pixel);
      const isSelected = mark.id === desk.selection.value;
      if (isSelected) paintRing(context, x, y, styles);
      drawSeverity(context, mark.severity, x, y, MARK_PX, styles);
      const room = placeOf([x, y], ...LABEL_ROOM);
      if (!mark.code || labelled.has(room)) continue;
      labelled.add(room);
      paintLabel(context, mark.code, x, y + MARK_PX, layout, styles);
    }
    paintFinding(context, desk, toStage, styles);
    const label = (text, x, y) => paintLabel(context, text, x, y, layout, styles);
    paintOnPicture(context, desk, { toStage, layout, cursor: this.#cursor, label, styles });
    if (this.#cursor && !desk.measuring.value) {
      const [x, y] = toStage(this.#cursor);
      label(atPointer(desk, this.#cursor, this.#markAt(this.#cursor)), x, y - POINTER_ROOM);
    }
  }

  /** Shows a note when the picture is not (yet) the wanted one. */
  #paintNote() {
    const { parts, desk } = this;
    const isLate = this.#player.isBusy && performance.now() - this.#busySince > BUSY_SHOWN_AFTER_MS;
    let note = '';
    if (!hasFilm(desk.inspection.value) || desk.playhead.value.frame < 0) note = whyNoPicture(desk);
    else if (this.#mode === 'REVIEW' && this.#player.isBusy && this.#player.rate === 0) {
      if (isLate) note = t('video.note_going', { frame: this.#player.asked });
      else setTimeout(() => this.isConnected && this.repaint(), BUSY_SHOWN_AFTER_MS);
    }
    if (parts.note.textContent !== note) parts.note.textContent = note;
  }
}

const tool = (part, sign, label, key) => html`<button class="button button--small button--icon stage__tool"
  data-part="${part}" aria-label="${label}" title="${withKey(label, key)}">${icon(sign)}</button>`;

const button = (part, sign, label, key) => html`<button class="button button--icon" data-part="${part}"
  aria-label="${label}" title="${t('video.with_key', { what: label, key })}">${icon(sign)}</button>`;

customElements.define('video-panel', VideoPanel);
