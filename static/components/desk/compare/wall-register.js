/**
 * The unrolled walls of two surveys in register, one over the other with an edge that is moved, along the axis of the
 * earlier one; below them how well their places are known, and where they are not.
 */

import { Axis, Plot } from '../../../core/wall/axis.js';
import { html, render } from '../../../core/page/html.js';
import { onThemeChange, sharpContext, typeScale } from '../../../core/page/screen.js';
import { Component } from '../../../core/page/store.js';
import { TilePictures, Unrolled } from '../../../core/wall/unrolled.js';
import { plusMinus } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { stripGestures } from '../../distance/strip/gestures.js';
import { paintAxis, paintPlate } from '../../distance/strip/paint.js';
import { icon } from '../../shared/icon/icon.js';

const LEFT = 34;
/** Heights below the wall: how well places are known, and the axis. */
const KNOWN = 26;
const AXIS = 28;
const BLINK_MS = 700;
const ZOOM = 1.6;
const UNSEEN = '#2c2c2c';
/** Pieces overlap by so much, so that no seam shows. */
const SEAM = 0.7;
const EDGE = '#ffd54a';

/** Events: `place` (detail: mm of the earlier run). */
export class WallRegister extends Component {
  #walls = null;
  #map = null;
  #gaps = [];
  #axis = new Axis();
  #edge = 0.5;
  #blink = { timer: 0, isLater: false };
  #scale = 1;

  mount() {
    /** @type {Parts<'compare/wall-register'>} */
    this.parts = render(
      this,
      html`<div class="register__tools row wrap pad-row">
          <h2 class="register__title grow">${t('walls.title')}</h2>
          <button type="button" class="button button--small" aria-pressed="false" data-part="blink">${icon('swap')}${t('walls.blink')}</button>
          <button type="button" class="button button--small button--icon" data-part="out" aria-label="${t('strip.zoom_out')}">${icon('minus')}</button>
          <button type="button" class="button button--small" data-part="whole">${t('strip.whole')}</button>
          <button type="button" class="button button--small button--icon" data-part="in" aria-label="${t('strip.zoom_in')}">${icon('plus')}</button>
        </div>
        <div class="register__track" data-part="track"><canvas class="covers" role="img" aria-label="${t('walls.picture')}" data-part="canvas"></canvas></div>
        <label class="register__edge row pad-row"><span class="small dim nowrap">${t('walls.earlier')}</span>
          <input type="range" class="grow" min="0" max="1" step="0.01" value="0.5" aria-label="${t('walls.edge')}" data-part="edge" />
          <span class="small dim nowrap">${t('walls.later')}</span></label>`,
    );
    const { parts } = this;
    this.listen(parts.edge, 'input', () => this.#moveEdge(Number(parts.edge.value)));
    this.listen(parts.blink, 'click', () => this.#toggleBlink());
    this.listen(parts.out, 'click', () => this.#axis.zoom(ZOOM));
    this.listen(parts.in, 'click', () => this.#axis.zoom(1 / ZOOM));
    this.listen(parts.whole, 'click', () => this.#axis.showWhole());
    this.listen(this.#axis, 'change', () => this.repaint());
    stripGestures(
      parts.track,
      this.#axis,
      {
        toMm: (px) => this.#plot.toMm(px / this.#scale),
        scrub: (px) => this.#moveEdge((px / this.#scale - this.#plot.left) / this.#plot.width),
        tap: (px) =>
          this.dispatchEvent(new CustomEvent('place', { detail: this.#plot.toMm(px / this.#scale), bubbles: true })),
        hover: () => {},
      },
      this.signal,
    );
    onThemeChange(() => this.repaint(), this.signal);
    const resized = new ResizeObserver(() => this.repaint());
    resized.observe(parts.track);
    this.signal.addEventListener('abort', () => {
      resized.disconnect();
      clearInterval(this.#blink.timer);
    });
  }

  /**
   * @param {{id: string, low: number, high: number}} earlier
   * @param {{id: string}} later
   * @param {import('../../../core/wall/wall-map.js').WallMap} map
   */
  async show(earlier, later, map) {
    const walls = [earlier, later].map(({ id }) => new Unrolled(id, this.signal));
    await Promise.all(walls.map((wall) => wall.load()));
    this.#walls = walls.map((wall) => ({ wall, pictures: new TilePictures(wall, this.signal) }));
    for (const { pictures } of this.#walls) this.listen(pictures, 'change', () => this.repaint());
    this.#map = map;
    this.#gaps = map.gapsWithin(earlier.low, earlier.high);
    this.#axis.setRun(earlier);
    this.repaint();
  }

  /** Brings a place of the earlier run into sight. @param {number} mm */
  reveal(mm) {
    this.#axis.reveal(mm);
  }

  get #plot() {
    return new Plot(this.#axis.value, this.parts.track.clientWidth / this.#scale, LEFT);
  }

  #moveEdge(share) {
    this.#edge = Math.min(Math.max(share, 0), 1);
    this.parts.edge.value = String(this.#edge);
    this.repaint();
  }

  #toggleBlink() {
    const isOn = this.#blink.timer === 0;
    clearInterval(this.#blink.timer);
    this.#blink.timer = isOn ? setInterval(() => this.#turn(), BLINK_MS) : 0;
    this.parts.blink.setAttribute('aria-pressed', String(isOn));
    this.repaint();
  }

  #turn() {
    this.#blink.isLater = !this.#blink.isLater;
    this.repaint();
  }

  // Drawing ---------------------------------------------------------------------------------

  paint() {
    if (!this.#walls || this.parts.track.clientWidth === 0) return;
    this.#scale = typeScale();
    const context = sharpContext(this.parts.canvas, this.#scale);
    const styles = getComputedStyle(this);
    const plot = this.#plot;
    const height = this.parts.track.clientHeight / this.#scale - KNOWN - AXIS;
    const edge = plot.left + this.#shownEdge * plot.width;
    const rows = this.#rowsIn(height);
    context.fillStyle = UNSEEN;
    context.fillRect(plot.left, 0, plot.width, height);
    clipped(context, [plot.left, 0, edge - plot.left, height], () => this.#paintEarlier(context, plot, rows));
    clipped(context, [edge, 0, plot.right - edge, height], () => this.#paintLater(context, plot, rows));
    clipped(context, [plot.left, 0, plot.width, height + KNOWN], () => {
      this.#paintGaps(context, styles, plot, height);
      this.#paintKnown(context, styles, plot, height);
      context.fillStyle = EDGE;
      context.fillRect(edge - 1, 0, 2, height);
    });
    const names = [t('walls.earlier'), t('walls.later')];
    if (edge > plot.left + 60) paintPlate(context, styles, names[0], plot.left + 40, 14, [plot.left, edge]);
    if (edge < plot.right - 60) paintPlate(context, styles, names[1], plot.right - 40, 14, [edge, plot.right]);
    paintAxis(context, (name) => styles.getPropertyValue(name), plot, this.#axis.value, height + KNOWN);
  }

  /** While it blinks, one wall is shown whole and then the other. */
  get #shownEdge() {
    if (this.#blink.timer === 0) return this.#edge;
    return this.#blink.isLater ? 0 : 1;
  }

  /** Rows of both walls: the arcs of the earlier one, which are all of a pipe. */
  #rowsIn(height) {
    const { arc_from_mm: from, arc_to_mm: to } = this.#walls[0].wall.value;
    const perMm = height / (to - from);
    return { from, to, perMm, toY: (arc) => (arc - from) * perMm };
  }

  /** Draws the part of a picture of a tile that lies between two places along the pipe, at other places. */
  #paintEarlier(context, plot, rows) {
    const [{ wall, pictures }] = this.#walls;
    const { low, high } = this.#axis.value;
    const layout = wall.value;
    const tiles = layout.tiles.filter(({ from_m: from, to_m: to }) => 1000 * to > low && 1000 * from < high);
    this.#want(pictures, tiles, plot, rows);
    const [top, bottom] = [layout.arc_from_mm, layout.arc_to_mm].map(rows.toY);
    for (const tile of tiles) {
      const picture = pictures.get(tile);
      const [left, right] = [tile.from_m, tile.to_m].map((m) => plot.toX(1000 * m));
      if (picture) context.drawImage(picture, left, top, right - left, bottom - top);
    }
  }

  /** Each tile in as many parts as pieces of the map cross it, each stretched and turned to where it belongs. */
  #paintLater(context, plot, rows) {
    const [, { wall, pictures }] = this.#walls;
    const { low, high } = this.#axis.value;
    const layout = wall.value;
    const inSight = this.#map.pieces.filter(
      ({ from: { earlier: a }, to: { earlier: b } }) => Math.max(a, b) > low && Math.min(a, b) < high,
    );
    const crosses = (tile, { from, to }) => 1000 * tile.to_m > from.later && 1000 * tile.from_m < to.later;
    const tiles = layout.tiles.filter((tile) => inSight.some((piece) => crosses(tile, piece)));
    this.#want(pictures, tiles, plot, rows);
    for (const tile of tiles) {
      const picture = pictures.get(tile);
      if (!picture) continue;
      for (const piece of inSight.filter((each) => crosses(tile, each)))
        this.#paintPiece(context, plot, rows, { picture, tile, piece, layout });
    }
  }

  #paintPiece(context, plot, rows, { picture, tile, piece, layout }) {
    const { sign } = this.#map;
    const [begin, end] = [1000 * tile.from_m, 1000 * tile.to_m];
    const [from, to] = [Math.max(begin, piece.from.later), Math.min(end, piece.to.later)];
    const [share, wide] = [(from - begin) / (end - begin), (to - from) / (end - begin)];
    /** @param {'earlier'|'arc'} what */
    const at = (mm, what) => {
      const part = (mm - piece.from.later) / (piece.to.later - piece.from.later) || 0;
      return piece.from[what] + part * (piece.to[what] - piece.from[what]);
    };
    const [left, right] = [from, to].map((mm) => plot.toX(at(mm, 'earlier')));
    const offset = at((from + to) / 2, 'arc');
    const [top, bottom] = [layout.arc_from_mm, layout.arc_to_mm].map((arc) => rows.toY(sign * arc + offset));
    const round = (rows.to - rows.from) * rows.perMm;
    for (const shift of [0, round, -round]) {
      context.save();
      // Driven the other way, left is right and up is down.
      context.transform(Math.sign(right - left) || 1, 0, 0, sign, left, top + shift);
      context.drawImage(
        picture,
        share * picture.width,
        0,
        wide * picture.width,
        picture.height,
        0,
        0,
        Math.abs(right - left) + SEAM,
        Math.abs(bottom - top),
      );
      context.restore();
    }
  }

  #want(pictures, tiles, plot, rows) {
    if (tiles.length === 0) return;
    const pixels = devicePixelRatio * this.#scale;
    const [{ from_m: from, to_m: to }] = tiles;
    pictures.want(tiles, ((1000 * (to - from)) / plot.mmPerUnit) * pixels, (rows.to - rows.from) * rows.perMm * pixels);
  }

  /** Greys where the map does not hold, with the reason. */
  #paintGaps(context, styles, plot, height) {
    for (const { from, to, reason } of this.#gaps) {
      const [left, right] = [from, to].map((mm) => Math.min(Math.max(plot.toX(mm), plot.left), plot.right));
      if (right - left < 1) continue;
      context.fillStyle = 'rgb(128 128 128 / 72%)';
      context.fillRect(left, 0, right - left, height + KNOWN);
      const text = wordFor('wall_gap', reason) ?? reason;
      context.font = `600 12px ${styles.getPropertyValue('--sans')}`;
      if (context.measureText(text).width + 14 < right - left)
        paintPlate(context, styles, text, (left + right) / 2, height / 2, [left, right]);
    }
  }

  /** Draws how far off a place may be on the other wall, as a band about the middle of its lane. */
  #paintKnown(context, styles, plot, height) {
    const { pieces } = this.#map;
    const most = Math.max(...pieces.flatMap(({ from, to }) => [from.u95, to.u95]), 1);
    const middle = height + KNOWN / 2;
    context.fillStyle = styles.getPropertyValue('--ok');
    for (const { from, to } of pieces) {
      const [x0, x1] = [from, to].map(({ earlier }) => plot.toX(earlier));
      const [h0, h1] = [from, to].map(({ u95 }) => Math.max(1, ((KNOWN / 2 - 3) * u95) / most));
      context.beginPath();
      context.moveTo(x0, middle - h0);
      context.lineTo(x1, middle - h1);
      context.lineTo(x1, middle + h1);
      context.lineTo(x0, middle + h0);
      context.fill();
    }
    if (pieces.length)
      paintPlate(context, styles, plusMinus(most / 1000), plot.left + 30, middle, [plot.left, plot.right]);
  }
}

/** Draws within a rectangle. */
function clipped(context, rectangle, draw) {
  context.save();
  context.beginPath();
  context.rect(...rectangle);
  context.clip();
  draw();
  context.restore();
}

customElements.define('wall-register', WallRegister);
