/** The part of the culvert that every strip shows, and round numbers along it. */

import { isWithin } from './spans.js';
import { Store } from '../page/store.js';
import { fromShown, lengthUnit, signed, toShown } from './units.js';

/** The closest zoom: on a wide screen many pixels for a millimetre. */
const LEAST_SPAN_MM = 40;
/** The followed robot keeps this distance from the ends, as a share of the visible span. */
const FOLLOW_MARGIN = 0.15;
/** The whole run ends at a multiple of the step, in at most this many steps. */
const WHOLE_STEPS = 16;

/** @typedef {{low: number, high: number}} Range distances in mm */

/** A store of the visible Range; zoom, pan and the growing run change it. @extends {Store<Range>} */
export class Axis extends Store {
  /** Distance in mm under the pointer in one of the strips; null when it is elsewhere. */
  pointer = new Store(/** @type {number|null} */ (null));

  #run = { low: 0, high: 0 };
  #whole = wholeOf({ low: 0, high: 0 });
  #isMoved = false;

  constructor() {
    super(wholeOf({ low: 0, high: 0 }));
  }

  /** The whole run, with ends rounded outwards. */
  get whole() {
    return this.#whole;
  }

  get isWhole() {
    return this.value.low === this.#whole.low && this.value.high === this.#whole.high;
  }

  get span() {
    return this.value.high - this.value.low;
  }

  /** @param {number} mm */
  holds(mm) {
    return isWithin(mm, this.value);
  }

  /** Sets another run; a page that showed all of the old one shows all of the new one. @param {Range} run */
  setRun(run) {
    if (run.low === this.#run.low && run.high === this.#run.high) return;
    const { isWhole } = this;
    this.#run = run;
    this.#whole = wholeOf(run);
    if (isWhole) this.#see(this.#whole.low, this.#whole.high);
    else this.#see(this.value.low, this.value.high);
  }

  /** Shows everything and follows the robot again. */
  showWhole() {
    this.#isMoved = false;
    this.#see(this.#whole.low, this.#whole.high);
  }

  /** @param {number} factor of the span, below 1 zooms in; the distance `aboutMm` keeps its place */
  zoom(factor, aboutMm = (this.value.low + this.value.high) / 2) {
    const span = Math.max(this.span * factor, LEAST_SPAN_MM);
    const low = aboutMm - ((aboutMm - this.value.low) * span) / this.span;
    this.#see(low, low + span);
  }

  /** Moves the view for a person, so that it no longer follows the robot. @param {number} mm */
  pan(mm) {
    this.#isMoved = true;
    this.#see(this.value.low + mm, this.value.high + mm);
  }

  /** Follows the robot, unless a person has moved the view. @param {number} mm */
  follow(mm) {
    if (this.#isMoved) return;
    const margin = FOLLOW_MARGIN * this.span;
    const { low, high } = this.value;
    if (mm > high - margin) this.#see(mm + margin - this.span, mm + margin);
    else if (mm < low + margin) this.#see(mm - margin, mm - margin + this.span);
  }

  /** Follows the robot from now on. */
  letFollow() {
    this.#isMoved = false;
  }

  /** Centres a distance unless it is visible. @param {number} mm */
  reveal(mm) {
    if (!this.holds(mm)) this.#see(mm - this.span / 2, mm + this.span / 2);
  }

  /** Limits the view to the run: first its length, then its place. @param {number} low @param {number} high */
  #see(low, high) {
    const { low: least, high: most } = this.#whole;
    const span = Math.min(high - low, most - least);
    const from = Math.min(Math.max(low, least), most - span);
    if (from !== this.value.low || from + span !== this.value.high) {
      this.set({ low: from, high: from + span });
    }
  }
}

/** @param {Range} run */
function wholeOf({ low, high }) {
  const far = Math.max(high, 1000);
  const step = roundStep((far - low) / WHOLE_STEPS);
  // A robot that stands at the zero point may read slightly below zero.
  return { low: low < -20 ? Math.floor(low / step) * step : 0, high: Math.ceil(far / step - 1e-9) * step };
}

/** Returns the next larger of 1, 2 and 5 times a power of ten of the shown unit, in mm. @param {number} mm */
function roundStep(mm) {
  const shown = toShown(mm / 1000);
  const power = 10 ** Math.floor(Math.log10(shown));
  const step = [1, 2, 5, 10].find((size) => size * power >= shown * (1 - 1e-9)) * power;
  return fromShown(step) * 1000;
}

/**
 * Returns round distances within a range, for an axis.
 * @param {Range} range
 * @param {number} atLeastMm between two of them
 * @returns {{mm: number, text: string}[]} the last text has the unit
 */
export function ticks({ low, high }, atLeastMm) {
  const step = roundStep(atLeastMm);
  const decimals = Math.max(0, -Math.floor(Math.log10(toShown(step / 1000)) + 1e-9));
  const [first, last] = [Math.ceil(low / step - 1e-6), Math.floor(high / step + 1e-6)];
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => {
    const mm = (first + i) * step;
    const text = signed(toShown(mm / 1000), decimals);
    return { mm, text: first + i === last ? `${text} ${lengthUnit}` : text };
  });
}

/** Maps distances to a strip `width` units wide, the same way in all strips. */
export class Plot {
  static RIGHT = 22;
  static NARROW = 560;

  /**
   * @param {Range} range
   * @param {number} width
   * @param {number} [left] where the range begins: beside the names of the lanes
   */
  constructor({ low, high }, width, left = width < Plot.NARROW ? 26 : 92) {
    this.low = low;
    this.left = left;
    this.right = width - Plot.RIGHT;
    this.width = Math.max(1, this.right - this.left);
    this.mmPerUnit = (high - low) / this.width;
  }

  get isNarrow() {
    return this.left < 40;
  }

  /** @param {number} mm */
  toX(mm) {
    return this.left + (mm - this.low) / this.mmPerUnit;
  }

  /** @param {number} x */
  toMm(x) {
    return this.low + (x - this.left) * this.mmPerUnit;
  }
}
