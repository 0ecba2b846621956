/**
 * A map of assets that is moved and zoomed. It has two canvases: one is drawn when the view, the assets or
 * the tiles change, and one above it for the mark that is highlighted; both at most once per animation frame.
 */

import { html, render } from '../../../core/page/html.js';
import { bindKeys } from '../../../core/page/keys.js';
import { CLOSEST, fitted, limited, moved, placeIn, toDegrees, toWorld, zoomed } from '../../../core/wall/mercator.js';
import { onThemeChange, sharpContext, typeScale } from '../../../core/page/screen.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { mapGestures } from './gestures.js';
import { paintBackground, paintHighlight, paintLines, paintMarks, paintMapScale } from './paint.js';
import { clustersOf, levelOf } from './places.js';
import { Tiles } from './tiles.js';

const MARGIN_PX = 40;
const STEP_PX = 80;
const ZOOM_STEP = 1.6;
/** A click this far beside a mark still means it. */
const BESIDE_PX = 4;
const MARK_HEIGHT_PX = 26;
const WORLD = { x: 0.5, y: 0.5, zoom: 0 };

/**
 * Fires `move` when the view has changed, `point` when another mark or none is under the pointer, `pick` when
 * one or none is clicked; `detail` is the mark in CSS px, or null.
 *
 * @typedef {object} Mark
 * @property {import('./places.js').Cluster} cluster
 * @property {number} x from the left edge
 * @property {number} y from the top
 * @property {number} reach half of its width
 */
export class MapCanvas extends Component {
  /** Duration of the last painting of the ground, in ms. */
  paintMs = 0;
  #places = [];
  /** The clusters at one level. */
  #gathered = { level: null, clusters: [] };
  #view = WORLD;
  /** CSS px in one unit of the drawing: marks grow with the type of the page. */
  #scale = typeScale();
  /** @type {Mark[]} those in view, the worst first */
  #marks = [];
  /** Name of the asset whose mark is highlighted, or null. */
  #highlighted = null;
  #pointed = null;
  #tiles = null;
  #isStale = true;

  mount() {
    /** @type {Parts<'map-page/map-canvas'>} */
    this.parts = render(
      this,
      html`<div class="map__sheet" data-part="sheet" tabindex="0" role="application" aria-label="${t('map.label')}" aria-describedby="map-keys">
        <canvas class="covers" data-part="ground"></canvas><canvas class="covers" data-part="above"></canvas></div>
        <p class="visually-hidden" id="map-keys">${t('map.keys')}</p>`,
    );
    const { sheet } = this.parts;
    mapGestures(
      sheet,
      {
        move: (by) => this.#see(moved(this.#view, this.#size, this.#inUnits(by))),
        zoom: (factor, at) => this.zoom(factor, this.#inUnits(at)),
        point: (at) => this.#point(at && this.#markAt(at)),
        pick: (at) => this.#announce('pick', this.#markAt(at)),
      },
      this.signal,
    );
    const arrows = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const step = (_, key) =>
      this.#see(
        moved(
          this.#view,
          this.#size,
          arrows[key].map((way) => way * STEP_PX),
        ),
      );
    bindKeys(sheet, [{ keys: Object.keys(arrows), run: step }], this.signal);
    onThemeChange(() => this.#stale(), this.signal);
    this.listen(window, 'online', () => {
      this.#tiles?.dropFailed();
      this.#stale();
    });
    const resized = new ResizeObserver(() => {
      this.#scale = typeScale();
      this.#see(this.#view);
    });
    resized.observe(sheet);
    this.signal.addEventListener('abort', () => resized.disconnect());
  }

  /** @param {string|null} template address of tiles @param {(isFaulty: boolean) => void} onPaint */
  setTiles(template, onPaint) {
    this.#tiles = template && new Tiles(template, () => this.#stale(), onPaint);
    this.#stale();
  }

  /** @param {import('./places.js').Place[]} places the worst first */
  show(places) {
    this.#places = places;
    this.#gathered = { level: null, clusters: [] };
    this.#stale();
  }

  /** [latitude, longitude, zoom] of the view. */
  get look() {
    const [lon, lat] = toDegrees([this.#view.x, this.#view.y]);
    return [lat, lon, this.#view.zoom];
  }

  set look([lat, lon, zoom]) {
    const [x, y] = toWorld([lon, lat]);
    this.#see({ x, y, zoom });
  }

  /** Shows all of some places. */
  fit(places = this.#places) {
    const points = places.flatMap((place) => place.points);
    if (points.length) this.#see(fitted(points, this.#size, MARGIN_PX));
  }

  /** Comes so close that the places of a cluster have marks of their own; false if they never have. */
  open({ places, x, y }) {
    if (clustersOf(places, CLOSEST).length === 1) return false;
    const { zoom } = this.#view;
    this.fit(places);
    if (this.#view.zoom <= zoom) this.#see({ x, y, zoom: zoom + 1 });
    return true;
  }

  /** @param {number} factor above 1 enlarges @param {[number, number]} [at] what stays, in units; the middle */
  zoom(factor, at = [this.#size.width / 2, this.#size.height / 2]) {
    this.#see(zoomed(this.#view, this.#size, factor, at));
  }

  zoomIn() {
    this.zoom(ZOOM_STEP);
  }

  zoomOut() {
    this.zoom(1 / ZOOM_STEP);
  }

  /** Whether the middle of a place is in sight. */
  sees(place) {
    const [x, y] = placeIn(this.#view, this.#size, [place.x, place.y]);
    return x >= 0 && y >= 0 && x <= this.#size.width && y <= this.#size.height;
  }

  /** @param {string|null} name of the asset whose mark gets a ring */
  highlight(name) {
    this.#highlighted = name;
    this.repaint();
  }

  paint() {
    const { ground, above } = this.parts;
    if (ground.clientWidth === 0) return;
    const styles = getComputedStyle(this);
    if (this.#isStale) {
      const begun = performance.now();
      this.#isStale = false;
      this.#paintGround({ context: sharpContext(ground, this.#scale), styles, view: this.#view, size: this.#size });
      this.paintMs = performance.now() - begun;
    }
    const sheet = { context: sharpContext(above, this.#scale), styles };
    for (const mark of new Set([this.#highlightedMark(), this.#pointed])) if (mark) paintHighlight(sheet, mark);
  }

  #highlightedMark() {
    if (this.#highlighted === null) return null;
    const isIn = ({ cluster }) => cluster.places.some(({ asset }) => asset.asset === this.#highlighted);
    return this.#marks.find(isIn);
  }

  #paintGround(sheet) {
    paintBackground(sheet, this.#tiles);
    const level = levelOf(this.#view.zoom);
    if (level !== this.#gathered.level) this.#gathered = { level, clusters: clustersOf(this.#places, level) };
    paintLines(sheet, this.#places);
    this.#marks = paintMarks(sheet, this.#gathered.clusters);
    paintMapScale(sheet);
  }

  get #size() {
    const { clientWidth, clientHeight } = this.parts.sheet;
    return { width: clientWidth / this.#scale, height: clientHeight / this.#scale };
  }

  /** @param {import('./gestures.js').At} px @returns {[number, number]} */
  #inUnits([x, y]) {
    return [x / this.#scale, y / this.#scale];
  }

  #see(view) {
    if (this.#size.width === 0) return;
    this.#view = limited(view, this.#size);
    this.#point(null);
    this.#stale();
    this.dispatchEvent(new Event('move'));
  }

  #stale() {
    this.#isStale = true;
    this.repaint();
  }

  /** Returns the mark at CSS px, the worst of several. */
  #markAt(at) {
    const [x, y] = this.#inUnits(at);
    const isAt = (mark) =>
      Math.abs(mark.x - x) <= mark.reach + BESIDE_PX && Math.abs(mark.y - y) <= MARK_HEIGHT_PX / 2 + BESIDE_PX;
    const found = this.#marks.find(isAt);
    return found ?? null;
  }

  #point(mark) {
    if (mark === this.#pointed) return;
    this.#pointed = mark;
    this.parts.sheet.classList.toggle('map__sheet--on-mark', mark !== null);
    this.repaint();
    this.#announce('point', mark);
  }

  #announce(type, mark) {
    const scaled = (name) => mark[name] * this.#scale;
    const detail = mark && { cluster: mark.cluster, x: scaled('x'), y: scaled('y'), reach: scaled('reach') };
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

customElements.define('map-canvas', MapCanvas);
