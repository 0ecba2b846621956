/**
 * The culvert as a strip along its distance: joints, defects, quality of the tracking, play head.
 * Drawn at most once per animation frame; every pixel column shows the worst of its frames, so that
 * 100 000 frames stay quick and a short loss stays visible.
 */

import { Component } from '../../core/store.js';
import { html, render } from '../../core/html.js';
import { sharpContext, typeScale } from '../../core/screen.js';
import { metres, metresNumber } from '../../core/units.js';
import { drawSeverity } from '../severity-mark/severity-mark.js';

const MARGIN = 30;
const LANES = { defects: 14, qualityTop: 29, qualityEnd: 61, axis: 65, labels: 83 };
const MARK_PX = 18;
const RANKS = { ok: 0, weak: 1, lost: 2 };
const COLOURS = ['--ok', '--weak', '--lost'];
const TICK_STEPS_MM = [50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 50000];
const TICK_PX = 64;
const DECIMALS_BELOW_MM = 1000;

class DistanceStrip extends Component {
  #isDragging = false;
  #columns = null;
  #scale = 1;
  #axis = { low: 0, high: 1000 };

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.parts = render(
      this,
      html`<div class="strip__legend" aria-hidden="true">
          <span class="strip__key strip__key--ok">locked</span>
          <span class="strip__key strip__key--weak">weak</span>
          <span class="strip__key strip__key--lost">lost</span>
        </div>
        <div class="strip__track" data-part="track" tabindex="0" role="slider" aria-label="Distance along the culvert"
          aria-valuemin="0" aria-valuemax="0" aria-valuenow="0"><canvas data-part="canvas"></canvas></div>`,
    );
    const { track } = this.parts;
    this.listen(track, 'pointerdown', (event) => {
      if (event.button !== 0) return;
      this.#isDragging = true;
      track.setPointerCapture(event.pointerId);
      this.#seekTo(event);
    });
    this.listen(track, 'pointermove', (event) => this.#isDragging && this.#seekTo(event));
    this.listen(track, 'pointerup', () => (this.#isDragging = false));
    this.listen(track, 'pointercancel', () => (this.#isDragging = false));
    // A click must not take the arrow keys away from stepping through the film.
    this.listen(track, 'mousedown', (event) => event.preventDefault());
    this.listen(track, 'keydown', (event) => this.#key(event));
    this.listen(this.desk.track, 'change', () => {
      this.#columns = null;
      this.repaint();
    });
    for (const store of [this.desk.playhead, this.desk.observations, this.desk.selection]) {
      this.listen(store, 'change', () => this.repaint());
    }
    this.listen(matchMedia('(prefers-color-scheme: light)'), 'change', () => this.repaint());
    const resized = new ResizeObserver(() => {
      this.#columns = null;
      this.repaint();
    });
    resized.observe(track);
    this.signal.addEventListener('abort', () => resized.disconnect());
  }

  /** Distances in mm at the two ends of the axis; the far end moves in whole steps. */
  #range() {
    const distances = this.desk.track.column('distance_mm');
    let [low, high] = [0, 1000];
    for (const distance of distances) {
      if (distance > high) high = distance;
      else if (distance < low) low = distance;
    }
    const step = TICK_STEPS_MM.find((size) => size >= (high - low) / 8) ?? TICK_STEPS_MM.at(-1);
    return { low: low < -20 ? Math.floor(low / step) * step : 0, high: Math.ceil(high / step) * step };
  }

  get #width() {
    return this.parts.track.clientWidth / this.#scale - 2 * MARGIN;
  }

  #toX(mm) {
    const { low, high } = this.#axis;
    return MARGIN + ((mm - low) / (high - low)) * this.#width;
  }

  #seekTo(event) {
    const { low, high } = this.#axis;
    const mm = low + ((event.offsetX / this.#scale - MARGIN) / this.#width) * (high - low);
    const mark = event.type === 'pointerdown' && this.#markAt(event);
    if (mark) this.desk.goTo(mark.id);
    else this.#seekDistance(mm);
  }

  #seekDistance(mm) {
    const frame = this.desk.track.frameAtDistance(mm, this.desk.playhead.value.frame);
    if (frame >= 0) this.desk.seek(frame);
  }

  #markAt({ offsetX, offsetY }) {
    const [x, y] = [offsetX / this.#scale, offsetY / this.#scale];
    if (Math.abs(y - LANES.defects) > MARK_PX) return null;
    return this.desk.observations.value.find(
      ({ distance_m }) => Math.abs(this.#toX(distance_m * 1000) - x) <= MARK_PX / 2,
    );
  }

  /** Arrows move by 10 mm, with Page by 500 mm; Home and End go to the ends. */
  #key(event) {
    const here = this.desk.playhead.value.row?.distance_mm ?? 0;
    const { low, high } = this.#axis;
    const goal = {
      ArrowRight: here + 10, ArrowUp: here + 10, ArrowLeft: here - 10, ArrowDown: here - 10,
      PageUp: here + 500, PageDown: here - 500, Home: low, End: high,
    }[event.key];
    if (goal === undefined || event.shiftKey) return;
    event.preventDefault();
    this.#seekDistance(goal);
  }

  paint() {
    const { canvas, track } = this.parts;
    if (track.clientWidth === 0) return;
    if (!this.#columns) {
      this.#scale = typeScale();
      this.#axis = this.#range();
      this.#columns = this.#worstPerColumn();
    }
    const context = sharpContext(canvas, this.#scale);
    const styles = getComputedStyle(this);
    const colour = (name) => styles.getPropertyValue(name);
    context.font = `500 12px ${colour('--sans')}`;
    context.textAlign = 'center';

    this.#paintQuality(context, colour);
    this.#paintAxis(context, colour);
    this.#paintJoints(context, colour);
    this.#paintPlayhead(context, colour);
    this.#paintDefects(context, styles);
    this.#describe();
  }

  /** Pixels of the screen a unit of the drawing. */
  get #pixels() {
    return devicePixelRatio * this.#scale;
  }

  /** For each column of screen pixels the lowest quality and the worst status of the frames in it. */
  #worstPerColumn() {
    const { track } = this.desk;
    const [distances, qualities, states] = ['distance_mm', 'quality', 'status'].map((name) => track.column(name));
    const columns = Array(Math.max(0, Math.ceil(this.#width * this.#pixels) + 1)).fill(null);
    let before = null;
    distances.forEach((distance, i) => {
      const at = Math.round((this.#toX(distance) - MARGIN) * this.#pixels);
      const rank = RANKS[states[i]];
      // Between two frames the robot passed every column between them.
      for (let x = Math.min(at, before ?? at); x <= Math.max(at, before ?? at); x += 1) {
        const worst = columns[x];
        columns[x] = {
          quality: Math.min(worst?.quality ?? 1, qualities[i]),
          rank: Math.max(worst?.rank ?? 0, rank),
        };
      }
      before = at;
    });
    return columns;
  }

  /** In whole pixels of the screen: fractions would leave seams between the columns. */
  #paintQuality(context, colour) {
    const pixels = this.#pixels;
    const [left, top, end] = [MARGIN, LANES.qualityTop, LANES.qualityEnd].map((y) => Math.round(y * pixels));
    const bar = Math.round(2 * pixels);
    context.save();
    context.resetTransform();
    context.fillStyle = colour('--raised');
    context.fillRect(left, top, Math.round(this.#width * pixels), end - top);
    this.#columns.forEach((column, i) => {
      if (!column) return;
      context.fillStyle = colour(COLOURS[column.rank]);
      const tall = Math.round(Math.max(3 * pixels, column.quality * (end - top)));
      context.globalAlpha = column.rank === 0 ? 0.55 : 0.9;
      context.fillRect(left + i, end - tall, 1, tall);
      if (column.rank === 2) {
        // Lost is barred over the whole height: seen without colour too.
        context.globalAlpha = Math.floor(i / bar) % 2 ? 0.75 : 0.25;
        context.fillRect(left + i, top, 1, end - top);
      }
    });
    context.restore();
  }

  #paintAxis(context, colour) {
    const { low, high } = this.#axis;
    const step =
      TICK_STEPS_MM.find((size) => (size / (high - low)) * this.#width >= TICK_PX) ?? TICK_STEPS_MM.at(-1);
    context.strokeStyle = colour('--line-strong');
    context.fillStyle = colour('--text-dim');
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(MARGIN, LANES.axis + 0.5);
    context.lineTo(MARGIN + this.#width, LANES.axis + 0.5);
    for (let mm = Math.ceil(low / step) * step; mm <= high; mm += step) {
      const x = Math.round(this.#toX(mm)) + 0.5;
      context.moveTo(x, LANES.axis);
      context.lineTo(x, LANES.axis + 6);
      const text = step < DECIMALS_BELOW_MM ? metresNumber(mm / 1000) : String(mm / 1000).replace('-', '−');
      context.fillText(mm + step > high ? `${text} m` : text, x, LANES.labels);
    }
    context.stroke();
  }

  #paintJoints(context, colour) {
    context.strokeStyle = colour('--text-dim');
    context.setLineDash([2, 3]);
    context.beginPath();
    for (const mm of this.desk.jointsUpTo(this.#axis.high)) {
      const x = Math.round(this.#toX(mm)) + 0.5;
      context.moveTo(x, LANES.qualityTop - 4);
      context.lineTo(x, LANES.axis);
    }
    context.stroke();
    context.setLineDash([]);
  }

  #paintDefects(context, styles) {
    const { observations, selection } = this.desk;
    for (const { id, distance_m, severity } of observations.value) {
      const x = this.#toX(distance_m * 1000);
      context.strokeStyle = styles.getPropertyValue('--text-dim');
      context.beginPath();
      context.moveTo(x, LANES.defects + MARK_PX / 2);
      context.lineTo(x, LANES.qualityTop);
      context.stroke();
      if (id === selection.value) {
        context.strokeStyle = styles.getPropertyValue('--accent');
        context.lineWidth = 2;
        context.beginPath();
        context.arc(x, LANES.defects, MARK_PX / 2 + 4, 0, 2 * Math.PI);
        context.stroke();
        context.lineWidth = 1;
      }
      drawSeverity(context, severity, x, LANES.defects, MARK_PX, styles);
    }
  }

  #paintPlayhead(context, colour) {
    const { row } = this.desk.playhead.value;
    if (!row) return;
    const x = Math.min(Math.max(this.#toX(row.distance_mm), MARGIN), MARGIN + this.#width);
    context.fillStyle = colour('--text');
    context.fillRect(x - 1, LANES.qualityTop - 6, 2, LANES.axis - LANES.qualityTop + 10);
    context.beginPath();
    context.moveTo(x - 6, LANES.axis + 8);
    context.lineTo(x + 6, LANES.axis + 8);
    context.lineTo(x, LANES.axis);
    context.fill();
  }

  #describe() {
    const { track } = this.parts;
    const { low, high } = this.#axis;
    const { row } = this.desk.playhead.value;
    const here = (row?.distance_mm ?? 0) / 1000;
    track.setAttribute('aria-valuemin', String(low / 1000));
    track.setAttribute('aria-valuemax', String(high / 1000));
    track.setAttribute('aria-valuenow', here.toFixed(2));
    track.setAttribute('aria-valuetext', row ? metres(here) : 'no distance yet');
  }
}

customElements.define('distance-strip', DistanceStrip);
