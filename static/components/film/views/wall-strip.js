/**
 * The unrolled wall along the same axis as the strip log, with joints, defects and the camera's present
 * view. A click tags the place, or goes to the frame that shows it.
 */

import { ApiError, poll } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { sharpContext } from '../../../core/page/screen.js';
import { ROUNDING_MM } from '../../../core/wall/spans.js';
import { stretchesOf } from '../../../core/defects/stretches.js';
import { chainage, clockHour, u95FromSigma } from '../../../core/wall/units.js';
import { TilePictures } from '../../../core/wall/unrolled.js';
import { frameShowing } from '../../../core/wall/wall.js';
import { t } from '../../../core/page/words.js';
import { paintOnWall, paintWallScale } from '../measure/on-wall.js';
import { runningMeasure, storedMeasures } from '../measure/paint.js';
import {
  numberEvery,
  paintHair,
  paintMark,
  paintPlate,
  paintPlayhead,
  paintStretch,
} from '../../distance/strip/paint.js';
import { stripSettings } from '../../distance/strip/settings.js';
import { titleOf } from '../../defects/finding-queue/words.js';
import { Strip, markText, nearestMark } from '../../distance/strip/strip.js';
import { OfferedFindings } from './offered-findings.js';
import { Rows, arcAt, clockAt, cutAtCrown, rowMarks } from './rows.js';

/** The grey of tile pixels that no frame has shown. */
const UNSEEN = '#2c2c2c';
const OUTLINE = 'rgb(8 10 12 / 70%)';
const MARK_PX = 20;
const LABEL_PX = 15;
const PLATE_AWAY_PX = 24;
/** Joints closer than this are left out. */
const JOINT_LINE_PX = 18;
/** Padding of a plate, with a gap to the next one. */
const PLATE_PX = 22;
const REFRESH_S = 1;
/** A wide lens sees farther along the pipe, but at too flat an angle to be useful. */
const SEEN_RADII = 4;
/** A step of the cursor, as a share of the visible length and of the arc. */
const CURSOR_STEP = 0.01;
const CURSOR_STEP_ARC = 0.04;
const FAR = 10;
const ANNOUNCED_AFTER_MS = 400;

export class WallStrip extends Strip {
  /** {mm, arc} of the keyboard's cursor, or null while it is not used */
  #cursor = null;
  /** The drawn marks: [{item, x, y}] */
  marks = [];
  #isFollowing = false;
  #loaded = null;
  #announceTimer = 0;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    const { desk } = this;
    const { diameter_mm: diameter, corrugation } = desk.inspection.value.rig.pipe;
    // A corrugated wall is unrolled between its crests and its valleys, as `Pipe.radius_mm` has it.
    const valleys = diameter / 2 + (corrugation?.depth_mm ?? 0);
    this.radius = diameter ? Math.sqrt((diameter / 2) * valleys) : null;
    this.pictures = new TilePictures(desk.unrolled, this.signal);
    /** @type {Parts<'views/wall-strip'>} */
    this.parts = render(
      this,
      html`<div class="wall__modes stack" role="group" data-needs="operator" aria-label="${t('wall.click')}">
          <button class="button" data-part="tag" title="${t('wall.tag_help')}">${t('wall.tag')}</button>
          <button class="button" data-part="seek" title="${t('wall.seek_help')}">${t('wall.seek')}</button>
        </div>
        <div class="wall__track" data-part="track" tabindex="0" role="application" aria-label="${t('wall.label')}"
          aria-describedby="wall-keys"><canvas class="covers" data-part="ground"></canvas><canvas class="covers" data-part="above"></canvas></div>
        <p class="wall__empty small" data-part="empty" hidden></p>
        <p class="visually-hidden" id="wall-keys">${t('wall.keys')}</p>
        <p class="visually-hidden" role="status" data-part="announced"></p>`,
    );
    const { parts } = this;
    for (const mode of ['tag', 'seek']) {
      this.listen(parts[mode], 'click', () => stripSettings.keep({ click: mode }));
      this.listen(parts[mode], 'mousedown', (event) => event.preventDefault());
    }
    this.listen(parts.track, 'keydown', (event) => this.#key(event));
    this.listen(parts.track, 'blur', () => this.#moveCursor(null));
    this.offered = new OfferedFindings(desk);
    this.follow();

    this.listen(desk.inspection, 'change', () => {
      this.#keepUp();
      this.#showEmpty();
    });
    this.listen(stripSettings, 'change', () => this.#showSettings());
    if (desk.windows) this.listen(desk.windows, 'change', () => this.#showSettings());
    this.listen([desk.findings, desk.findings.current, desk.findings.filter], 'change', () => this.stale());
    this.listen(desk.measuring, 'change', () => this.repaint());
    this.listen([desk.unrolled, this.pictures, desk.track], 'change', () => this.stale());
    this.signal.addEventListener('abort', () => clearTimeout(this.#announceTimer));
    this.#showSettings();
  }

  // What happens elsewhere ------------------------------------------------------------------

  #showSettings() {
    const { windows } = this.desk;
    // In a window of its own it is all there is.
    this.hidden = windows !== null && (windows.has('wall') || !stripSettings.has('wall'));
    for (const mode of ['tag', 'seek']) {
      this.parts[mode].setAttribute('aria-pressed', String(stripSettings.value.click === mode));
    }
    this.#keepUp();
  }

  /** Fetches the layout repeatedly while it grows, and again when distances were corrected. */
  async #keepUp() {
    const { desk } = this;
    const stateOf = ({ revision, status }) => `${revision} ${status}`;
    if (this.hidden || this.#isFollowing || stateOf(desk.inspection.value) === this.#loaded) return;
    this.#isFollowing = true;
    await poll(
      async () => {
        if (this.hidden) return null;
        const state = stateOf(desk.inspection.value);
        await desk.unrolled.load();
        this.#loaded = state;
        const isCurrent = state === stateOf(desk.inspection.value) && !desk.inspection.isUnfinished;
        return isCurrent ? null : REFRESH_S;
      },
      this.signal,
      () => {}, // the page itself reports an unreachable server
    );
    this.#isFollowing = false;
  }

  // Pointer and keys ------------------------------------------------------------------------

  tapBeside(x, y) {
    if (!this.rows) return;
    const finding = this.#findingAt(x, y);
    if (finding) this.desk.lookAt(finding);
    else this.#act(this.plot.toMm(x), this.rows.toArc(y));
  }

  /** The finding on offer there; while a click is wanted for something else, there is none. */
  #findingAt(x, y) {
    return this.desk.picking.value ? null : this.offered.at(x, y);
  }

  /** Tags the place, or shows the frame that shows it best. */
  async #act(mm, arc) {
    const { desk, parts } = this;
    const { value: pick } = desk.picking; // what the click was for
    parts.track.classList.add('wall__track--busy');
    try {
      const near = desk.playhead.value.frame;
      const found = await frameShowing(desk.inspection.id, this.#placeOf(mm, arc), near, this.signal);
      if (!found) desk.fault(t('wall.not_seen'));
      else if (pick) pick === desk.picking.value && pick(found);
      else if (stripSettings.value.click === 'tag' && mayEdit()) desk.tag(found);
      else desk.seek(found.frame);
    } catch (error) {
      if (!(error instanceof ApiError)) {
        if (error.name === 'AbortError') return;
        throw error;
      }
      desk.fault(error);
    } finally {
      parts.track.classList.remove('wall__track--busy');
    }
  }

  #placeOf(mm, arc) {
    return {
      distance_m: mm / 1000,
      right_mm: this.radius === null ? arc : this.radius * Math.sin(arc / this.radius),
      clock_h: this.radius === null ? null : clockAt(arc, this.radius),
    };
  }

  #key(event) {
    const { axis, playhead } = this.desk;
    if (!this.rows || event.ctrlKey || event.metaKey || event.altKey) return;
    const here = this.#cursor ?? {
      mm: this.inSight(playhead.value.row?.distance_mm ?? axis.value.low),
      arc: (this.rows.from + this.rows.to) / 2,
    };
    if (event.key === 'Enter' && this.#cursor) {
      event.stopPropagation();
      event.preventDefault();
      this.#act(here.mm, here.arc);
      return;
    }
    const [along, around] = {
      ArrowRight: [1, 0],
      ArrowLeft: [-1, 0],
      ArrowDown: [0, 1],
      ArrowUp: [0, -1],
    }[event.key] ?? [0, 0];
    if (!along && !around) return;
    // Elsewhere the arrows step through the film.
    event.stopPropagation();
    event.preventDefault();
    const times = event.shiftKey ? FAR : 1;
    const { from, to } = this.rows;
    this.#moveCursor({
      mm: Math.min(Math.max(here.mm + along * times * CURSOR_STEP * axis.span, axis.whole.low), axis.whole.high),
      arc: Math.min(Math.max(here.arc + around * times * CURSOR_STEP_ARC * (to - from), from), to),
    });
  }

  #moveCursor(cursor) {
    if (cursor === this.#cursor) return;
    this.#cursor = cursor;
    clearTimeout(this.#announceTimer);
    if (cursor) {
      this.desk.axis.reveal(cursor.mm);
      // A held key would be announced at every step.
      this.#announceTimer = setTimeout(
        () => (this.parts.announced.textContent = this.#textOf(cursor)),
        ANNOUNCED_AFTER_MS,
      );
    }
    this.repaint();
  }

  #textOf({ mm, arc }) {
    const where = chainage(mm / 1000);
    if (this.radius !== null) return `${where} · ${clockHour(clockAt(arc, this.radius))}`;
    const beside = Math.abs(Math.round(arc));
    return `${where} · ${arc < 0 ? t('wall.left', { mm: beside }) : t('wall.right', { mm: beside })}`;
  }

  markAt(x, y) {
    if (this.desk.picking.value) return null; // the click is wanted, not the mark under it
    const marks = this.marks.map((mark) => ({ item: mark.item, apart: Math.hypot(mark.x - x, mark.y - y) }));
    return nearestMark(marks, MARK_PX);
  }

  // Drawing ---------------------------------------------------------------------------------

  paintGround(styles) {
    const { plot, height } = this;
    const layout = this.desk.unrolled.value;
    this.#showEmpty();
    this.rows = layout && new Rows(layout, this.radius, height);
    this.#paintWall(styles, plot, layout, height);
  }

  paintAbove(context, styles) {
    const { plot, height } = this;
    const { row } = this.desk.playhead.value;
    if (row) this.#paintNow(context, styles, plot, row, height);
    if (!this.rows) return;
    paintOnWall(context, styles, plot, height, runningMeasure(this.desk.measuring, null), this.#toPlace);
    paintWallScale(context, styles, plot);
    this.#paintPointer(context, styles, plot, height);
  }

  #showEmpty() {
    const { empty } = this.parts;
    empty.hidden = Boolean(this.desk.unrolled.value?.tiles.length);
    const text = this.desk.inspection.isUnfinished ? t('wall.coming') : t('wall.none');
    if (empty.textContent !== text) empty.textContent = text;
  }

  #paintWall(styles, plot, layout, height) {
    const context = sharpContext(this.parts.ground, this.scale);
    const colour = (name) => styles.getPropertyValue(name);
    this.marks = [];
    if (!layout) return;
    const [top, bottom] = [this.rows.from, this.rows.to].map((arc) => this.rows.toY(arc));
    context.fillStyle = UNSEEN;
    context.fillRect(plot.left, top, plot.width, bottom - top);
    context.save();
    context.beginPath();
    context.rect(plot.left, 0, plot.width, height);
    context.clip();
    this.#paintTiles(context, plot, layout);
    this.#paintRowLines(context, plot);
    this.#paintJoints(context, styles, plot, height);
    this.#paintStretches(context, styles, plot);
    this.offered.paint(context, plot, this.rows, this.radius);
    const measured = this.desk.observations.value.filter((item) => item.measures);
    context.restore();
    paintOnWall(context, styles, plot, height, storedMeasures(this.desk, measured), this.#toPlace);
    this.#paintRowLabels(context, colour, plot, height);
    this.#paintMarks(context, styles, plot);
  }

  #paintTiles(context, plot, layout) {
    const { low, high } = this.desk.axis.value;
    const inSight = layout.tiles.filter(
      ({ from_m: from, to_m: to }) => to * 1000 > low + ROUNDING_MM && from * 1000 < high - ROUNDING_MM,
    );
    const pixels = devicePixelRatio * this.scale;
    const middle = (low + high) / 2000;
    const away = ({ from_m: from, to_m: to }) => Math.abs((from + to) / 2 - middle);
    const { arc_from_mm: arcFrom, arc_to_mm: arcTo } = layout;
    const tall = this.rows.toY(arcTo) - this.rows.toY(arcFrom);
    if (inSight.length) {
      const [{ from_m: from, to_m: to }] = inSight;
      const wide = ((to - from) * 1000) / plot.mmPerUnit;
      this.pictures.want(
        inSight.toSorted((a, b) => away(a) - away(b)),
        wide * pixels,
        tall * pixels,
      );
    }
    // In whole pixels of the screen: fractions would leave seams between the tiles.
    const [top, bottom] = [arcFrom, arcTo].map((arc) => Math.round(this.rows.toY(arc) * pixels));
    context.save();
    // The clip stays: only the units change.
    context.scale(1 / pixels, 1 / pixels);
    for (const tile of inSight) {
      const picture = this.pictures.get(tile);
      if (!picture) continue;
      const [left, right] = [tile.from_m, tile.to_m].map((m) => Math.round(plot.toX(m * 1000) * pixels));
      context.drawImage(picture, left, top, right - left, bottom - top);
    }
    context.restore();
  }

  #paintRowLines(context, plot) {
    context.fillStyle = 'rgb(255 255 255 / 14%)';
    for (const { arc } of rowMarks(this.rows, this.radius, LABEL_PX)) {
      context.fillRect(plot.left, Math.round(this.rows.toY(arc)), plot.width, 1);
    }
  }

  #paintRowLabels(context, colour, plot, height) {
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    context.font = `500 11px ${colour('--sans')}`;
    for (const { arc, text } of rowMarks(this.rows, this.radius, LABEL_PX)) {
      const y = this.rows.toY(arc);
      context.fillStyle = colour(arc === 0 ? '--text' : '--text-dim');
      context.fillText(text, plot.left - 6, y + 0.5);
    }
    if (plot.isNarrow) return;
    context.textAlign = 'left';
    context.fillStyle = colour('--text-dim');
    const what = this.radius === null ? [t('wall.left_side'), t('wall.right_side')] : [t('wall.clock')];
    context.font = `500 10px ${colour('--sans')}`;
    what.forEach((word, i) => context.fillText(word, 8, i === 0 ? 12 : height - 12));
  }

  #paintJoints(context, styles, plot, height) {
    const { axis } = this.desk;
    const { joints } = this;
    const lineEvery = numberEvery(joints, plot, JOINT_LINE_PX);
    context.font = `600 12px ${styles.getPropertyValue('--sans')}`;
    const widths = joints.map((joint) => context.measureText(nameOfJoint(joint)).width);
    const plateEvery = numberEvery(joints, plot, Math.max(0, ...widths) + PLATE_PX);
    for (const joint of joints) {
      const { number, distance_m: m, u95_m: u95M } = joint;
      if (number % lineEvery || !axis.holds(m * 1000)) continue;
      const x = Math.round(plot.toX(m * 1000)) + 0.5;
      const isExpected = u95M === null;
      context.setLineDash(isExpected ? [2, 7] : []);
      context.strokeStyle = isExpected ? 'rgb(255 255 255 / 45%)' : 'rgb(255 255 255 / 85%)';
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x, height);
      context.stroke();
      if (number === null || number % plateEvery) continue;
      paintPlate(context, styles, nameOfJoint(joint), x, height - 12, [plot.left, plot.right]);
    }
    context.setLineDash([]);
  }

  /** Draws a bar from start to finish, at the clock position of the start. */
  #paintStretches(context, styles, plot) {
    const { observations, track } = this.desk;
    for (const stretch of stretchesOf(observations.value, track.range.high / 1000)) {
      paintStretch(context, styles, plot, stretch, this.#rowOf(stretch.start) - 3.5, 7, UNSEEN, OUTLINE);
    }
  }

  #paintMarks(context, styles, plot) {
    const { observations, selection, axis } = this.desk;
    for (const item of observations.value) {
      if (item.distance_m === null || !axis.holds(item.distance_m * 1000)) continue;
      const x = plot.toX(item.distance_m * 1000);
      const y = this.#rowOf(item);
      this.marks.push({ item, x, y });
      paintMark(context, styles, item, x, y, MARK_PX, item.id === selection.value);
    }
  }

  /**
   * Returns the place of a measured point on the strip.
   * @type {(point: import('../../../core/wall/measure.js').Point) => [number, number]|null}
   */
  #toPlace = ({ frame, pixel }) => {
    const row = this.desk.track.row(frame);
    const point = row && this.desk.wall?.at(...pixel, row);
    return point ? [this.plot.toX(1000 * point.distance_m), this.rows.toY(this.#arcOf(point))] : null;
  };

  /** Returns the row of an observation: of its pixel, else of its clock position, else of the invert. */
  #rowOf({ frame, pixel, clock_from: from, clock }) {
    const row = pixel && this.desk.track.row(frame);
    const point = row && this.desk.wall?.at(...pixel, row);
    if (point) return this.rows.toY(this.#arcOf(point));
    const hour = from ?? clock;
    return this.rows.toY(this.radius !== null && typeof hour === 'number' ? arcAt(hour, this.radius) : 0);
  }

  #arcOf({ right_mm: right, clock_h: clock }) {
    return this.radius === null || clock === null ? right : arcAt(clock, this.radius);
  }

  /** Draws the camera's present view, and the interval of its distance. */
  #paintNow(context, styles, plot, row, height) {
    const half = (u95FromSigma(row.sigma_distance_mm) * 1000) / plot.mmPerUnit;
    const x = plot.toX(row.distance_mm);
    context.save();
    context.beginPath();
    context.rect(plot.left, 0, plot.width, height);
    context.clip();
    if (this.rows) this.#paintView(context, plot, row);
    if (half > 1.5) {
      context.fillStyle = styles.getPropertyValue('--accent');
      context.globalAlpha = 0.28;
      context.fillRect(x - half, 0, 2 * half, height);
      context.globalAlpha = 1;
    }
    context.restore();
    paintPlayhead(context, '#ffffff', 'rgb(0 0 0 / 60%)', plot, row.distance_mm, 0, height);
  }

  #paintView(context, plot, row) {
    const reach = this.radius === null ? Infinity : SEEN_RADII * this.radius;
    const points = (this.desk.wall?.outline(row) ?? []).map((point) => ({
      mm: Math.min(Math.max(1000 * point.distance_m, row.x_mm - reach), row.x_mm + reach),
      arc: this.#arcOf(point),
    }));
    if (points.length < 3) return;
    context.beginPath();
    for (const line of cutAtCrown(points, this.radius)) {
      line.forEach(({ mm, arc }, i) => context[i ? 'lineTo' : 'moveTo'](plot.toX(mm), this.rows.toY(arc)));
    }
    for (const [width, colour] of [
      [3.5, 'rgb(0 0 0 / 60%)'],
      [1.5, '#ffd54a'],
    ]) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.stroke();
    }
    context.lineWidth = 1;
  }

  #paintPointer(context, styles, plot, height) {
    if (this.#cursor) {
      const { mm, arc } = this.#cursor;
      this.#paintCross(context, styles, plot, { x: plot.toX(mm), y: this.rows.toY(arc) }, height);
      return;
    }
    const { axis } = this.desk;
    if (axis.pointer.value === null || !axis.holds(axis.pointer.value)) return;
    if (this.hover) this.#paintCross(context, styles, plot, this.hover, height);
    else paintHair(context, styles, plot.toX(axis.pointer.value), 0, height);
  }

  #paintCross(context, styles, plot, { x, y }, height) {
    paintHair(context, styles, x, 0, height);
    context.beginPath();
    context.moveTo(x - 9, Math.round(y) + 0.5);
    context.lineTo(x + 9, Math.round(y) + 0.5);
    context.stroke();
    const mark = this.markAt(x, y);
    const finding = mark ? null : this.#findingAt(x, y);
    const text = mark
      ? markText(mark)
      : finding
        ? titleOf(finding)
        : this.#textOf({ mm: plot.toMm(x), arc: this.rows.toArc(y) });
    const above = y - PLATE_AWAY_PX;
    paintPlate(context, styles, text, x, above < 12 ? y + PLATE_AWAY_PX : above, [plot.left, plot.right]);
  }
}

const nameOfJoint = ({ number, u95_m: u95M }) =>
  u95M === null ? t('wall.joint_expected', { number }) : t('wall.joint', { number: number ?? '–' });

customElements.define('wall-strip', WallStrip);
