/** The run as lanes along its distance: defects, joints, quality, speed and more, with the play head. */

import { deviations } from '../../../core/survey/counter.js';
import { COMPLAINTS, USUAL_LIMIT_M_PER_MIN, namesOf } from '../../../core/survey/health.js';
import { html, render } from '../../../core/page/html.js';
import { isUnmeasured } from '../../../core/survey/inspection.js';
import { sharpContext } from '../../../core/page/screen.js';
import { isWithin } from '../../../core/wall/spans.js';
import { stretchesOf } from '../../../core/defects/stretches.js';
import { chainage, timecode } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { windowButton } from './window-button.js';
import { closesElsewhere } from '../../shared/menu/menu.js';
import { paintAxis, paintHair, paintPlate, paintPlayhead } from './paint.js';
import { stripSettings } from './settings.js';
import { Strip, markText, nearestMark } from './strip.js';
import { bindZoom, tool, zoomAxis, zoomTools } from './zoom-tools.js';
import { Band, Speeds } from './columns.js';
import { openGoTo } from '../../desk/actions/go-to.js';
import { LANES, MARK_PX, laneWord, paintGround } from './lanes.js';

/** On these screens the film needs the room more than the lanes. */
const LOW_SCREEN = matchMedia('(max-height: 860px) and (min-width: 1100px)');
/** Lanes of this height have room for a second line beside them. */
const TWO_LINES = 26;
const TOP = 6;
const GAP = 2;
const AXIS_HEIGHT = 20;
/** Lanes of quantities that only our own tracking measures. */
const MEASURED = new Set(['quality', 'speed', 'lateral', 'yaw', 'health']);
/** Least ranges of the lanes. */
const LEAST_SCALES = { speed: 1.25 * USUAL_LIMIT_M_PER_MIN, lateral_mm: 5, yaw_deg: 2, counter_mm: 20 };

export class StripLog extends Strip {
  /** What the lanes draw, in bands by name; null while they must be computed again. */
  #bands = null;
  /** By how many mm the counter is ahead of the camera in each frame; null while it is not compared. */
  #ahead = null;
  /** The same in each column; null while it must be computed again. */
  #counter = null;
  #speeds = new Speeds();
  #generation = 0;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    const { desk } = this;
    /** @type {Parts<'strip/strip-log'>} */
    this.parts = render(
      this,
      html`<div class="strip__bar row wrap gap-1 line-below">
          <details class="menu holds" data-part="menu">
            <summary class="button button--quiet button--small">${icon('layers')}${t('strip.lanes')}</summary>
            <ul class="menu__list strip__lane-list panel">
              ${[...LANES.map(({ name }) => name), 'wall'].map(
                (name) => html`<li><label class="strip__lane row gap-3">
                <input type="checkbox" value="${name}" ${stripSettings.has(name) ? html`checked` : null} />
                ${laneWord(name)}</label></li>`,
              )}
            </ul>
          </details>
          <p class="strip__legend flow gap-3 dim" aria-hidden="true">
            <span class="strip__key">${t('strip.ok')}</span>
            <span class="strip__key strip__key--weak">${t('strip.weak')}</span>
            <span class="strip__key strip__key--lost">${t('strip.lost')}</span>
          </p>
          <span class="spacer grow"></span>
          ${tool('goTo', 'search', t('strip.go_to'), 'G', t('strip.go_to_short'))}
          ${zoomTools()}
          <button class="button button--quiet button--small button--icon" data-part="window"></button>
        </div>
        <div class="strip__track" data-part="track" tabindex="0" role="slider" aria-label="${t('strip.label')}"
          aria-valuemin="0" aria-valuemax="0" aria-valuenow="0"><canvas class="covers" data-part="ground"></canvas><canvas
          class="covers" data-part="above"></canvas></div>`,
    );
    const { parts } = this;
    closesElsewhere(parts.menu, this.signal);
    this.listen(parts.menu, 'change', () => this.#switchLanes());
    this.listen(parts.goTo, 'click', () => this.goTo());
    bindZoom(parts, desk, this.signal);
    windowButton(parts.window, desk, 'wall', this.signal);
    this.listen(parts.track, 'keydown', (event) => this.#key(event));
    this.follow();
    this.listen(desk.track, 'change', () => this.#tracked());
    this.listen(desk.health, 'change', () => this.stale(true));
    this.listen(desk.counter, 'change', () => this.#compare());
    this.#tracked();
    this.#compare();
  }

  // Commands of the keys and buttons ---------------------------------------------------------

  goTo() {
    openGoTo(this.desk);
  }

  /** @param {1|-1} direction 1 zooms in */
  zoom(direction) {
    zoomAxis(this.desk, direction);
  }

  #switchLanes() {
    const boxes = [...this.parts.menu.querySelectorAll('input:checked')];
    stripSettings.keep({ lanes: boxes.map(({ value }) => value) });
  }

  /** Arrows move by 10 mm, Page by 500 mm; Home and End go to the ends of the run. */
  #key(event) {
    const here = this.desk.playhead.value.row?.distance_mm ?? 0;
    const { low, high } = this.desk.track.range;
    const goal = {
      ArrowRight: here + 10,
      ArrowUp: here + 10,
      ArrowLeft: here - 10,
      ArrowDown: here - 10,
      PageUp: here + 500,
      PageDown: here - 500,
      Home: low,
      End: high,
    }[event.key];
    if (goal === undefined || event.shiftKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    this.seekDistance(goal);
    this.desk.axis.reveal(goal);
  }

  tapBeside(x) {
    this.seekDistance(this.plot.toMm(x));
  }

  // Events from elsewhere ----------------------------------------------------------------------

  #tracked() {
    const { track } = this.desk;
    if (track.generation !== this.#generation) {
      this.#generation = track.generation;
      this.#speeds = new Speeds();
      this.#bands = null;
    }
    this.#speeds.extend(track);
    this.#compare();
  }

  /** Compares the burnt-in counter with the camera, where the server has found what they say about each other. */
  #compare() {
    const { counter, track } = this.desk;
    this.#ahead = counter.value?.comparison
      ? deviations(track.column('distance_mm'), counter.readings.column('counter_m'), counter.faults)
      : null;
    this.#counter = null;
    this.stale();
  }

  /** @param {boolean} isMoved whether frames lie at other columns than before */
  stale(isMoved = false) {
    if (isMoved) this.#bands = this.#counter = null;
    super.stale();
  }

  // Drawing ---------------------------------------------------------------------------------

  /** Returns the visible lanes, [{lane, top, height}], and where the axis begins. */
  #arrange(complaints) {
    const isLow = LOW_SCREEN.matches;
    let top = TOP;
    const isUnmeasuredRun = isUnmeasured(this.desk.inspection.value);
    const isShown = ({ name }) =>
      stripSettings.has(name) && !(isUnmeasuredRun && MEASURED.has(name)) && (name !== 'counter' || this.#ahead);
    const seen = LANES.filter(isShown);
    const rows = seen.map((lane) => {
      const height = lane.height(complaints, isLow);
      const row = { lane, top, height };
      top += height + GAP;
      return row;
    });
    return { rows, axisTop: top };
  }

  paintAbove(context, styles) {
    const { plot } = this;
    const { row } = this.desk.playhead.value;
    const { axisTop } = this.arrangement;
    if (row) this.#paintPlayhead(context, styles, plot, row.distance_mm, axisTop);
    this.#paintPointer(context, styles, plot, axisTop);
    this.#describe();
  }

  paintGround(styles) {
    const { desk, parts } = this;
    const plot = this.plot;
    const pixels = devicePixelRatio * this.scale;
    this.#fillBands(plot, pixels);
    const complaints = namesOf(desk.health.occurred);
    this.arrangement = this.#arrange(complaints);
    const { rows, axisTop } = this.arrangement;
    const height = `${(axisTop + AXIS_HEIGHT) / 16}rem`;
    if (parts.track.style.height !== height) parts.track.style.height = height;

    const context = sharpContext(parts.ground, this.scale);
    const colours = new Map();
    const colour = (name) => {
      if (!colours.has(name)) colours.set(name, styles.getPropertyValue(name));
      return colours.get(name);
    };
    const { high } = desk.track.range;
    const scene = {
      context,
      colour,
      styles,
      plot,
      pixels,
      bands: this.#bands,
      scales: this.#scales(),
      observations: desk.observations.value,
      stretches: stretchesOf(desk.observations.value, high / 1000),
      selected: desk.selection.value,
      joints: this.joints,
      complaints,
      counter: this.#counter,
      counterFaults: this.#counterFaults(),
    };
    for (const { top, height: tall } of rows) paintGround(scene, top, tall);
    paintAxis(context, colour, plot, desk.axis.value, axisTop);
    for (const { lane, top, height: tall } of rows) {
      lane.paint(scene, top, tall);
      this.#paintLabel(scene, lane, top, tall);
    }
  }

  /** Adds the frames that are new to what the lanes draw. */
  #fillBands(plot, pixels) {
    const { track, health } = this.desk;
    const raster = { count: Math.ceil(plot.width * pixels), low: plot.low, mmPerColumn: plot.mmPerUnit / pixels };
    const [distances, states, qualities, lateral, yaw] = ['distance_mm', 'status', 'quality', 'y_mm', 'yaw_deg'].map(
      (name) => track.column(name),
    );
    const { complaints } = health;
    const values = {
      rank: (i) => states[i],
      quality: (i) => qualities[i],
      speed: (i) => this.#speeds.values[i],
      lateral: (i) => lateral[i],
      yaw: (i) => yaw[i],
      ...Object.fromEntries(COMPLAINTS.map((name, bit) => [name, (i) => (complaints[i] ?? 0) & (1 << bit)])),
    };
    this.#bands ??= Object.fromEntries(Object.keys(values).map((name) => [name, new Band(raster)]));
    for (const [name, valueAt] of Object.entries(values)) this.#bands[name].add(distances, valueAt);
    if (!this.#ahead || this.#counter) return;
    this.#counter = new Band(raster);
    this.#counter.add(distances, (i) => this.#ahead[i] ?? NaN);
  }

  /** The faults of the counter, at the distances of the camera. */
  #counterFaults() {
    const { counter, track } = this.desk;
    const distances = track.column('distance_mm');
    return counter.faults
      .filter(({ last_frame: last }) => last < distances.length)
      .map(({ kind, first_frame: first, last_frame: last }) => {
        const ends = [distances[first], distances[last]];
        return { kind, from_mm: Math.min(...ends), to_mm: Math.max(...ends) };
      });
  }

  /** What the counter says at a frame; null while it is not compared. */
  #counterAt(frame) {
    if (!this.#ahead) return null;
    return {
      m: this.desk.counter.readings.column('counter_m')[frame],
      ahead_mm: this.#ahead[frame] ?? NaN,
      faults: this.desk.counter.faults.filter(
        ({ first_frame: first, last_frame: last }) => first <= frame && frame <= last,
      ),
    };
  }

  #scales() {
    const { speed, lateral, yaw } = this.#bands;
    return {
      speed: Math.max(LEAST_SCALES.speed, 1.1 * speed.most),
      lateral_mm: rounded(Math.max(LEAST_SCALES.lateral_mm, lateral.most)),
      yaw_deg: rounded(Math.max(LEAST_SCALES.yaw_deg, yaw.most)),
      counter_mm: rounded(Math.max(LEAST_SCALES.counter_mm, this.#counter?.most ?? 0)),
    };
  }

  #paintLabel({ context, colour, plot, scales }, lane, top, height) {
    const scale = height >= TWO_LINES && lane.scale?.(scales);
    context.textBaseline = 'middle';
    if (plot.isNarrow) {
      // No room beside it: inside the lane, on its own ground; the marks need no explanation.
      if (lane.name === 'defects') return;
      context.textAlign = 'left';
      context.font = `500 10px ${colour('--sans')}`;
      const text = laneWord(lane.name);
      context.fillStyle = colour('--raised');
      context.globalAlpha = 0.8;
      context.fillRect(plot.left, top, context.measureText(text).width + 6, 12);
      context.globalAlpha = 1;
      context.fillStyle = colour('--text-dim');
      context.fillText(text, plot.left + 3, top + 6.5);
      return;
    }
    context.textAlign = 'right';
    context.fillStyle = colour('--text');
    context.font = `550 12px ${colour('--sans')}`;
    const middle = top + height / 2 + 0.5;
    context.fillText(laneWord(lane.name), plot.left - 8, scale ? middle - 6 : middle);
    if (!scale) return;
    context.fillStyle = colour('--text-dim');
    context.font = `500 10px ${colour('--sans')}`;
    context.fillText(scale, plot.left - 8, middle + 7);
  }

  #paintPlayhead(context, styles, plot, mm, axisTop) {
    const colour = styles.getPropertyValue('--text');
    paintPlayhead(context, colour, styles.getPropertyValue('--raised'), plot, mm, 0, axisTop + 1);
    const x = plot.toX(mm);
    if (x < plot.left - 1 || x > plot.right + 1) return;
    context.beginPath();
    context.moveTo(x - 6, 0);
    context.lineTo(x + 6, 0);
    context.lineTo(x, 7);
    context.fill();
  }

  #paintPointer(context, styles, plot, axisTop) {
    const { value: mm } = this.desk.axis.pointer;
    if (mm === null || !this.desk.axis.holds(mm)) return;
    const x = plot.toX(mm);
    /** @type {[number, number]} */
    const within = [2, this.parts.track.clientWidth / this.scale - 2];
    paintHair(context, styles, x, 0, axisTop);
    paintPlate(context, styles, chainage(mm / 1000), x, axisTop + 12, within);
    if (!this.hover) return; // the pointer is in the other strip
    const { y } = this.hover;
    const text = this.#valueAt(mm, x, y);
    if (text) paintPlate(context, styles, text, x, Math.max(11, Math.min(y - 20, this.height - 40)), within);
  }

  /** Returns the read-out of the lane under the pointer, and the time of its frame. */
  #valueAt(mm, x, y) {
    const { track, playhead, health } = this.desk;
    const mark = this.markAt(x, y);
    const row = this.arrangement.rows.find(({ top, height }) => y >= top && y < top + height + GAP);
    const isTracked = track.length > 0 && isWithin(mm, track.range);
    const frame = isTracked ? track.frameAtDistance(mm, playhead.value.frame) : -1;
    if (mark) return markText(mark);
    if (frame < 0) return '';
    const joint = nearest(this.joints, mm / 1000);
    const values = {
      row: track.row(frame),
      speed: this.#speeds.values[frame],
      complaints: health.complaints[frame] ?? 0,
      joint,
      counter: this.#counterAt(frame),
    };
    const value = row?.lane.read?.(values);
    const name = row && value && `${laneWord(row.lane.name)} ${value}`;
    return [name, timecode(values.row.time_s, 1)].filter(Boolean).join(' · ');
  }

  markAt(x, y) {
    const lane = this.arrangement?.rows.find(({ lane: { name } }) => name === 'defects');
    if (!lane || y < lane.top - 4 || y > lane.top + lane.height) return null;
    const plot = this.plot;
    const marks = this.desk.observations.value
      .filter(({ distance_m: m }) => m !== null)
      .map((item) => ({ item, apart: Math.abs(plot.toX(item.distance_m * 1000) - x) }));
    return nearestMark(marks, MARK_PX);
  }

  #describe() {
    const { track } = this.parts;
    const { low, high } = this.desk.axis.whole;
    const { row } = this.desk.playhead.value;
    const here = (row?.distance_mm ?? 0) / 1000;
    track.setAttribute('aria-valuemin', String(low / 1000));
    track.setAttribute('aria-valuemax', String(high / 1000));
    track.setAttribute('aria-valuenow', here.toFixed(2));
    track.setAttribute('aria-valuetext', row ? chainage(here) : t('strip.none'));
  }
}

/** Rounds the end of a scale to one significant digit. */
function rounded(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return Number(([1, 2, 5, 10].find((size) => size * power >= value) * power).toPrecision(3));
}

const nearest = (joints, metres) =>
  joints.reduce(
    (best, joint) => (best && Math.abs(best.distance_m - metres) <= Math.abs(joint.distance_m - metres) ? best : joint),
    null,
  );

customElements.define('strip-log', StripLog);
