/**
 * Common base of the strips along the distance: one axis with its pointer, marks to tap, and two
 * canvases, one that is drawn when the data or the axis change, and one above it for what moves with
 * the pointer and the film; both at most once per animation frame.
 */

import { Plot } from '../../../core/wall/axis.js';
import { onThemeChange, sharpContext, typeScale } from '../../../core/page/screen.js';
import { Component } from '../../../core/page/store.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { stripGestures } from './gestures.js';
import { stripSettings } from './settings.js';

/** A tap this far beside a mark still selects it. */
const BESIDE_PX = 3;

/** A strip has the parts `track`, `ground` and `above`. */
export class Strip extends Component {
  /** @type {Desk} set before `follow` */
  desk;
  /** CSS px in one unit: type and lines grow with the type of the page. */
  scale = 1;
  /** {x, y} of the pointer in units, or null */
  hover = null;
  /** Time of the last painting of the ground, in ms. */
  paintMs = 0;
  #isStale = true;

  follow() {
    const { track } = this.parts;
    const { axis, observations, selection, corrections, playhead } = this.desk;
    stripGestures(
      track,
      axis,
      {
        toMm: (px) => this.plot.toMm(px / this.scale),
        scrub: (px) => this.seekDistance(this.inSight(this.plot.toMm(px / this.scale))),
        tap: (x, y) => this.#tap(x / this.scale, y / this.scale),
        hover: (x, y) => this.#point(x === null ? null : { x: x / this.scale, y: y / this.scale }),
      },
      this.signal,
    );
    this.listen([observations, selection, corrections, stripSettings], 'change', () => this.stale());
    this.listen(axis, 'change', () => this.stale(true));
    this.listen([axis.pointer, playhead], 'change', () => this.repaint());
    onThemeChange(() => this.stale(), this.signal);
    const resized = new ResizeObserver(() => this.stale(true));
    resized.observe(track);
    this.signal.addEventListener('abort', () => resized.disconnect());
  }

  get plot() {
    return new Plot(this.desk.axis.value, this.parts.track.clientWidth / this.scale);
  }

  /** Size of the track, in units. */
  get height() {
    return this.parts.track.clientHeight / this.scale;
  }

  /** The joints, from a pipe unit before the axis to one after it. */
  get joints() {
    return this.desk.joints;
  }

  seekDistance(mm) {
    const frame = this.desk.track.frameAtDistance(mm, this.desk.playhead.value.frame);
    if (frame >= 0) this.desk.seek(frame);
  }

  inSight(mm) {
    const { low, high } = this.desk.axis.value;
    return Math.min(Math.max(mm, low), high);
  }

  /** Draws the canvas that changes with the data or the axis. @param {CSSStyleDeclaration} _styles */
  paintGround(_styles) {}

  /** Draws the one above it. @param {CanvasRenderingContext2D} _context @param {CSSStyleDeclaration} _styles */
  paintAbove(_context, _styles) {}

  /**
   * Returns the observation whose mark is there, or null.
   * @param {number} _x
   * @param {number} _y
   * @returns {import('../../../core/defects/observations.js').Observation|null}
   */
  markAt(_x, _y) {
    return null;
  }

  /** What a tap does where there is no mark. @param {number} _x @param {number} _y */
  tapBeside(_x, _y) {}

  /** Marks the ground as out of date. @param {boolean} [_isMoved] whether frames lie at other columns than before */
  stale(_isMoved) {
    this.#isStale = true;
    this.repaint();
  }

  paint() {
    const { parts } = this;
    if (this.hidden || parts.track.clientWidth === 0) return;
    this.scale = typeScale();
    const styles = getComputedStyle(this);
    if (this.#isStale) {
      const begun = performance.now();
      this.#isStale = false;
      this.paintGround(styles);
      this.paintMs = performance.now() - begun;
    }
    this.paintAbove(sharpContext(parts.above, this.scale), styles);
  }

  #tap(x, y) {
    const mark = this.markAt(x, y);
    if (mark) this.desk.goTo(mark.id);
    else this.tapBeside(x, y);
  }

  #point(place) {
    this.hover = place;
    this.desk.axis.pointer.set(place && this.plot.toMm(place.x));
    this.repaint();
  }
}

/**
 * Returns the observation whose mark is nearest, if it is near enough.
 * @param {{item: object, apart: number}[]} marks each with its distance from the pointer
 * @param {number} size of the marks
 */
export function nearestMark(marks, size) {
  const near = marks.filter(({ apart }) => apart <= size / 2 + BESIDE_PX);
  return near.toSorted((a, b) => a.apart - b.apart)[0]?.item ?? null;
}

/** Returns the text of the plate for the observation under the pointer. */
export const markText = ({ code, distance_m: m }) => `${code ?? t('desk.tag')} · ${chainage(m)}`;
