/** Two runs of the same culvert side by side: pictures of the same place, defects matched. */

import { refusalIn } from '../../../core/server/api.js';
import { html, patchList, render } from '../../../core/page/html.js';
import { hasFilm, isUnmeasured } from '../../../core/survey/inspection.js';
import { bindKeys } from '../../../core/page/keys.js';
import { squareOf, toSquare } from '../../../core/wall/pixels.js';
import { Component } from '../../../core/page/store.js';
import { rounded } from '../../../core/wall/rounding.js';
import {
  chainage,
  clockHour,
  lengthUnit,
  parseDistance,
  plusMinus,
  timecode,
  toShown,
  u95FromSigma,
} from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';
import { showKeys } from '../actions/key-help.js';
import { drawSeverity, severityMark } from '../../shared/severity-mark/severity-mark.js';
import { topBar } from '../../shared/top-bar/top-bar.js';
import { BlankPlayer, FilePlayer, StillPlayer } from '../../film/video/players.js';
import { byDistance, byWalls } from './alignment.js';
import { KINDS, growth, isAllRound, match, mirrored, pairsOf, sectorOf } from './matching.js';
import { Run } from './run.js';
import './compare-strip.js';
import './run-choice.js';
import './wall-comparison.js';

const STEP_MM = 10;
const LEAP_MM = 500;
/** A run that ends this far before a place has not seen it. */
const MISSED_MM = 30;

/** Width of the mark of a defect, as a share of the picture. */
const MARK_SHARE = 0.045;

const SIDES = ['a', 'b'];
/** The words of the history of an asset, which shows the same. */
const kindWord = (kind) => wordFor('assets.change', kind) ?? t('compare.uncovered');

export class ComparePage extends Component {
  #runs = null;
  #players = { a: null, b: null };
  #scene = null;
  #place = 0;
  #isReversed = false;
  /** {map, matched} of the server once it has the walls in register. */
  #walls = null;
  #lengthM = 0;
  #kind = 'all';
  #selected = null;

  async mount() {
    document.title = t('compare.page');
    const query = new URLSearchParams(location.search);
    this.ids = { a: query.get('a'), b: query.get('b') };
    /** @type {Parts<'compare/compare-page'>} */
    this.parts = render(
      this,
      html`${topBar()}
        <main id="main" class="compare" tabindex="-1">
          <h1 class="visually-hidden">${t('compare.title')}</h1>
          <run-choice data-part="choice"></run-choice>
          <div data-part="message" role="status"></div>
          <div class="compare__body stack gap-3 one-column" data-part="body" hidden></div>
        </main>`,
    );
    try {
      await this.parts.choice.load();
      if (this.ids.a && this.ids.b) await this.#open();
      else this.#say(t('compare.choose_help'));
    } catch (error) {
      const refusal = refusalIn(error);
      if (refusal) this.#say(errorText(refusal), 'error');
    }
  }

  #say(text, /** @type {'info'|'error'} */ kind = 'info') {
    render(this.parts.message, message(kind, text));
  }

  async #open() {
    const { ids } = this;
    if (ids.a === ids.b) {
      this.#say(t('compare.same'), 'error');
      return;
    }
    this.#say(t('page.loading'));
    const [a, b] = await Promise.all(SIDES.map((side) => Run.load(ids[side], this.signal)));
    const untracked = [a, b].find((run) => run.track.length === 0);
    if (untracked) {
      this.#say(t('compare.not_tracked', { name: untracked.inspection.name }), 'error');
      return;
    }
    this.#runs = { a, b };
    const known = SIDES.map((side) => this.#runs[side].inspection.header.known_length_m).find((m) => m > 0);
    this.#lengthM = known ?? Math.max(a.high, b.high) / 1000;
    this.#isReversed = SIDES.some((side) => ids[side] === this.#other(side).inspection.header.reverse_of);
    render(this.parts.message, html``);
    this.#build();
  }

  #other(side) {
    return this.#runs[side === 'a' ? 'b' : 'a'];
  }

  #build() {
    const { body } = this.parts;
    body.hidden = false;
    Object.assign(
      this.parts,
      render(
        body,
        html`<div class="compare__settings row wrap">
          <p class="help compare__aligned" data-part="aligned" role="status"></p>
          <label class="switch row" data-part="reversedBox"><input type="checkbox" data-part="reversed" />${t('compare.reversed')}</label>
          <div class="field compare__length" data-part="lengthBox"><label for="compare-length">${t('compare.length')}</label>
            <span class="input-with-unit"><input class="input" id="compare-length" inputmode="decimal" autocomplete="off"
              data-part="length" /><span class="unit">${lengthUnit}</span></span></div>
        </div>
        <wall-comparison class="compare__walls" data-part="walls"></wall-comparison>
        <div class="compare__pictures stack gap-3 halves">${SIDES.map((side) => pictureMarkup(side, this.#runs[side]))}</div>
        <div class="panel compare__strip">
          <compare-strip data-part="strip"></compare-strip>
          <div class="compare__move row" role="group" aria-label="${t('compare.move')}">
            ${moveButton('backFar', 'stepBack', t('compare.back_far'), 'Shift + ←')}
            ${moveButton('back', 'back', t('compare.back'), '←')}
            <p class="compare__place strong number" role="status" data-part="place"></p>
            ${moveButton('forward', 'forward', t('compare.forward'), '→')}
            ${moveButton('forwardFar', 'stepForward', t('compare.forward_far'), 'Shift + →')}
          </div>
        </div>
        <section class="panel compare__defects column" aria-label="${t('compare.defects')}">
          <div class="flow gap-1 pad-2 line-below" role="group" aria-label="${t('compare.show')}">
            ${[['all', t('compare.all')], ...KINDS.map((kind) => [kind, kindWord(kind)])].map(
              ([kind, label]) => html`<button class="button button--small" data-kind="${kind}">${label}
              <span class="dim number"></span></button>`,
            )}
          </div>
          <ol class="scrolls pad-1" data-part="rows"></ol>
          <p class="pad-4 dim unless-empty" data-part="nothing"></p>
        </section>`,
      ),
    );
    const { parts } = this;
    this.listen(parts.walls, 'aligned', ({ detail }) => this.#setting(() => (this.#walls = detail)));
    this.listen(parts.walls, 'place', ({ detail }) => this.#goTo(detail));
    this.listen(parts.reversed, 'change', () => this.#setting(() => (this.#isReversed = parts.reversed.checked)));
    this.listen(parts.length, 'change', () => this.#typedLength());
    this.listen(parts.strip, 'place', ({ detail }) => this.#goTo(detail));
    this.listen(parts.strip, 'pick', ({ detail }) => this.#select(detail));
    for (const button of this.querySelectorAll('.button[data-kind]')) {
      this.listen(button, 'click', () => {
        this.#kind = button.dataset.kind;
        this.#showPairs();
      });
    }
    const moves = { backFar: -LEAP_MM, back: -STEP_MM, forward: STEP_MM, forwardFar: LEAP_MM };
    for (const [part, mm] of Object.entries(moves)) {
      this.listen(parts[part], 'click', () => this.#goTo(this.#place + mm));
    }
    for (const side of SIDES) this.#play(side, this.#runs[side].inspection.video.playable);
    this.signal.addEventListener('abort', () => SIDES.forEach((side) => this.#players[side]?.close()));
    this.#bindKeys();
    this.#align();
    this.#goTo(this.#scene.low);
    parts.walls.show(this.#runs.a, this.#runs.b);
  }

  #bindKeys() {
    const bindings = [
      { keys: ['ArrowLeft'], label: t('compare.back'), run: () => this.#goTo(this.#place - STEP_MM) },
      { keys: ['ArrowRight'], label: t('compare.forward'), run: () => this.#goTo(this.#place + STEP_MM) },
      { keys: ['Shift+ArrowLeft'], label: t('compare.back_far'), run: () => this.#goTo(this.#place - LEAP_MM) },
      { keys: ['Shift+ArrowRight'], label: t('compare.forward_far'), run: () => this.#goTo(this.#place + LEAP_MM) },
      { keys: ['Home'], label: t('compare.to_start'), run: () => this.#goTo(this.#scene.low) },
      { keys: ['End'], label: t('compare.to_end'), run: () => this.#goTo(this.#scene.high) },
      { keys: ['n'], label: t('compare.next'), run: () => this.#neighbour(1) },
      { keys: ['p'], label: t('compare.previous'), run: () => this.#neighbour(-1) },
      { keys: ['?'], label: t('keys.list'), run: () => showKeys([{ title: t('compare.move'), bindings }]) },
    ];
    bindKeys(document, bindings, this.signal);
    // The slider takes the arrows from the page, with the same meaning.
    const arrows = new Map(bindings.flatMap(({ keys, run }) => keys.map((key) => [key, run])));
    this.listen(this.parts.strip, 'keydown', (event) => {
      const run = arrows.get(`${event.shiftKey ? 'Shift+' : ''}${event.key}`);
      if (!run || event.defaultPrevented || !/Arrow|Home|End/.test(event.key)) return;
      event.preventDefault();
      run();
    });
  }

  // Pictures ---------------------------------------------------------------------------------

  #play(side, isPlayable) {
    const run = this.#runs[side];
    const [canvas, video] = [this.parts[`${side}Canvas`], this.parts[`${side}Video`]];
    const player = this.#playerOf(run, canvas, video, isPlayable);
    this.#players[side]?.close();
    this.#players[side] = player;
    player.addEventListener('frame', () => this.#shown(side));
    player.addEventListener('unplayable', () => {
      this.#play(side, false);
      this.#players[side].seek(Math.max(player.asked, 0));
    });
  }

  #playerOf(run, canvas, video, isPlayable) {
    if (!hasFilm(run.inspection)) return new BlankPlayer(canvas, run.track);
    return isPlayable
      ? new FilePlayer(canvas, run.track, video, run.path, squareOf(run.inspection.video))
      : new StillPlayer(canvas, run.track, run.path);
  }

  #shown(side) {
    const { frame } = this.#players[side];
    const run = this.#runs[side];
    const row = run.track.row(frame);
    const { parts } = this;
    this.#drawMarks(run, parts[`${side}Canvas`], row);
    parts[`${side}Distance`].textContent = chainage(row.distance_mm / 1000);
    const u95M = isUnmeasured(run.inspection) ? null : u95FromSigma(row.sigma_distance_mm);
    parts[`${side}Interval`].textContent = plusMinus(u95M);
    parts[`${side}Frame`].textContent = t('compare.frame', { frame, time: timecode(row.time_s) });
    if (!this.#players[side].isBusy) parts[`${side}Stage`].classList.remove('compare__stage--late');
  }

  /** Draws on the picture itself, which is repainted with every frame. */
  #drawMarks(run, canvas, row) {
    const context = canvas.getContext('2d');
    const styles = getComputedStyle(this);
    for (const { severity, pixel } of run.marksIn(row)) {
      const [x, y] = toSquare(run.inspection.video, pixel);
      drawSeverity(context, severity, x, y, canvas.width * MARK_SHARE, styles);
    }
  }

  /** Moves both runs to a place, in mm of run A. */
  #goTo(mm) {
    const { low, high, alignment } = this.#scene;
    this.#place = Math.min(Math.max(mm, low), high);
    this.parts.strip.place = this.#place;
    const own = { a: this.#place, b: alignment.toB(this.#place) };
    for (const side of SIDES) {
      const run = this.#runs[side];
      const isMissed = own[side] < run.low - MISSED_MM || own[side] > run.high + MISSED_MM;
      this.parts[`${side}Note`].textContent = isMissed ? t('compare.not_seen', { run: side.toUpperCase() }) : '';
      this.parts[`${side}Stage`].classList.toggle('compare__stage--missed', isMissed);
      const player = this.#players[side];
      const frame = run.track.frameAtDistance(own[side], Math.max(player.asked, 0));
      if (frame === player.asked) continue;
      this.parts[`${side}Stage`].classList.add('compare__stage--late');
      player.seek(frame);
    }
    this.parts.place.textContent = chainage(this.#place / 1000);
    if (this.#selected && Math.abs(this.#selected.mm - this.#place) > 0.5) this.#mark(null);
  }

  // Alignment and defects --------------------------------------------------------------------

  #setting(change) {
    change();
    this.#align();
    this.#goTo(this.#place);
  }

  #typedLength() {
    const metres = parseDistance(this.parts.length.value);
    this.parts.length.setAttribute('aria-invalid', String(!(metres > 0)));
    if (metres > 0) this.#setting(() => (this.#lengthM = metres));
  }

  #align() {
    const { a, b } = this.#runs;
    const { parts } = this;
    const walls = this.#walls;
    if (walls) this.#isReversed = walls.map.sign < 0;
    const alignment = walls ? byWalls(walls.map) : byDistance(this.#isReversed, 1000 * this.#lengthM);
    const ends = [a.low, a.high, alignment.toA(b.low), alignment.toA(b.high)];
    const pairs = walls ? pairsOf(a, b, walls.matched, alignment) : match(a, b, alignment, this.#isReversed);
    this.#scene = { low: Math.min(...ends), high: Math.max(...ends), a, b, alignment, pairs };
    parts.strip.scene = this.#scene;
    parts.aligned.textContent = walls ? t('compare.by_walls') : t('compare.by_distance');
    parts.reversed.checked = this.#isReversed;
    parts.reversedBox.hidden = walls !== null;
    parts.lengthBox.hidden = !this.#isReversed || walls !== null;
    parts.length.value = String(rounded(toShown(this.#lengthM), 3));
    this.#showPairs();
  }

  #showPairs() {
    const { parts } = this;
    const { pairs } = this.#scene;
    for (const button of this.querySelectorAll('.button[data-kind]')) {
      const { kind } = button.dataset;
      button.setAttribute('aria-pressed', String(kind === this.#kind));
      const count = kind === 'all' ? pairs.length : pairs.filter((pair) => pair.kind === kind).length;
      button.querySelector('.number').textContent = String(count);
    }
    const shown = pairs.filter(({ kind }) => this.#kind === 'all' || kind === this.#kind);
    patchList(
      parts.rows,
      shown,
      keyOf,
      () => createRow((pair) => this.#select(pair)),
      (row, pair) => this.#updateRow(row, pair),
    );
    parts.nothing.textContent =
      pairs.length === 0 ? t('compare.nothing') : shown.length ? '' : t('compare.nothing_kind');
    this.#mark(this.#selected && pairs.find((pair) => keyOf(pair) === keyOf(this.#selected)));
  }

  #updateRow(row, pair) {
    const { a, b, kind } = pair;
    const item = b ?? a;
    const { parts } = row;
    row.pair = pair;
    row.dataset.kind = kind;
    render(parts.mark, severityMark(item.severity));
    parts.code.textContent = [item.code, item.char1, item.char2].filter(Boolean).join(' ');
    parts.label.textContent = this.#runs[b ? 'b' : 'a'].catalogue.label(item.code, item.char1, item.char2);
    parts.kind.textContent = kindWord(kind);
    const clock = clockText(a ? sectorOf(a) : mirrored(sectorOf(b), this.#isReversed));
    parts.more.textContent = [growthText(pair), clock].filter(Boolean).join(' · ');
    parts.a.textContent = a ? t('compare.at_a', { where: chainage(a.distance_m) }) : '';
    parts.b.textContent = b ? t('compare.at_b', { where: chainage(b.distance_m) }) : '';
  }

  /** Moves both runs to a pair; each to the frame in which its own defect was tagged, if it has one. */
  #select(pair) {
    this.#goTo(pair.mm);
    this.parts.walls.reveal(pair.mm);
    for (const side of SIDES) {
      if (pair[side] && pair[side].frame < this.#runs[side].track.length) this.#players[side].seek(pair[side].frame);
    }
    this.#mark(pair);
  }

  #mark(pair) {
    this.#selected = pair ?? null;
    for (const row of this.parts.rows.children) {
      const isSelected = this.#selected !== null && row.dataset.key === keyOf(this.#selected);
      row.parts.main.setAttribute('aria-current', String(isSelected));
      if (isSelected) row.scrollIntoView({ block: 'nearest' });
    }
  }

  #neighbour(direction) {
    const shown = [...this.parts.rows.children].map(({ pair }) => pair);
    const next =
      direction > 0
        ? shown.find(({ mm }) => mm > this.#place + 0.5)
        : shown.findLast(({ mm }) => mm < this.#place - 0.5);
    if (next) this.#select(next);
  }
}

const keyOf = ({ a, b }) => `${a?.id ?? ''}:${b?.id ?? ''}`;

/** @param {[number, number]|null} sector as run A sees it */
function clockText(sector) {
  if (sector === null) return '';
  if (isAllRound(sector)) return t('dial.all_round');
  const [from, to] = sector.map((hours) => hours || 12);
  return from === to ? clockHour(from) : t('units.clock_sector', { from, to });
}

function growthText({ a, b }) {
  const grown = a && b && growth(a, b);
  if (!grown) return '';
  const { name, from, to } = grown;
  return name === 'severity' ? t('compare.grown_severity', { from, to }) : t('compare.grown_quantity', { from, to });
}

function createRow(select) {
  const row = Object.assign(document.createElement('li'), { className: 'pair', pair: null });
  row.parts = render(
    row,
    html`<button class="pair__main stack bare full" data-part="main"><span data-part="mark"></span>
      <span class="pair__what one-line"><b data-part="code"></b> <span data-part="label"></span></span>
      <span class="pair__more one-line small number"><b data-part="kind"></b> <span class="dim" data-part="more"></span></span>
      <span class="pair__where row gap-3 small nowrap number"><span class="unless-empty" data-part="a"></span><span class="unless-empty" data-part="b"></span></span></button>`,
  );
  // A click leaves the keyboard focus with the page.
  row.addEventListener('mousedown', (event) => event.preventDefault());
  row.parts.main.addEventListener('click', () => select(row.pair));
  return row;
}

const pictureMarkup = (side, { id, inspection }) => html`<figure class="compare__run column shrinks">
  <figcaption class="compare__caption flow">
    <span class="compare__letter small">${side === 'a' ? t('compare.a') : t('compare.b')}</span>
    <a class="one-line shrinks strong plain" href="/inspections/${id}" title="${t('compare.open', { name: inspection.name })}">${inspection.name}</a>
    <span class="dim">${inspection.header.date}</span>
    <span class="compare__distance nowrap number"><b data-part="${side}Distance"></b> <span class="dim" data-part="${side}Interval"></span></span>
  </figcaption>
  <div class="compare__stage holds" data-part="${side}Stage">
    <video class="covers" data-part="${side}Video" muted playsinline preload="auto" tabindex="-1" aria-hidden="true"></video>
    <canvas class="covers" data-part="${side}Canvas" role="img" aria-label="${t('compare.picture', { run: side.toUpperCase() })}"
      width="${squareOf(inspection.video).width}" height="${squareOf(inspection.video).height}"></canvas>
    <p class="compare__note on-film strong nowrap unless-empty" data-part="${side}Note"></p>
    <p class="compare__frame on-film small number" data-part="${side}Frame">${t('compare.loading')}</p>
  </div></figure>`;

const moveButton = (part, sign, label, key) => html`<button class="button button--icon" data-part="${part}"
  aria-label="${label}" title="${t('video.with_key', { what: label, key })}">${icon(sign)}</button>`;

customElements.define('compare-page', ComparePage);
