/** The stretch of the culvert that every strip shows, and round numbers along it. */

import { Store } from './store.js';
import { fromShown, lengthUnit, signed, toShown } from './units.js';

/** The closest look: on a wide screen many pixels a millimetre. */
const LEAST_SPAN_MM = 40;
/** The robot that is followed stays so far away from the ends, as a share of what is seen. */
const FOLLOW_MARGIN = 0.15;
/** The whole run ends at a round number: in at most so many of them. */
const WHOLE_STEPS = 16;

/** @typedef {{low: number, high: number}} Range distances in mm */

/** A store of the Range that is seen; it changes by zoom and pan, and with the growing run. */
export class Axis extends Store {
  /** Distance in mm under the pointer in one of the strips, null when it is elsewhere. */
  pointer = new Store(null);

  #run = { low: 0, high: 0 };
  #whole = wholeOf({ low: 0, high: 0 });
  #isMoved = false;

  constructor() {
    super(wholeOf({ low: 0, high: 0 }));
  }

  /** The whole run, ends rounded outwards. */
  get whole() {
    return this.#whole;
  }

  get isWhole() {
    return this.value.low === this.#whole.low && this.value.high === this.#whole.high;
  }

  get span() {
    return this.value.high - this.value.low;
  }

  holds(mm) {
    return mm >= this.value.low && mm <= this.value.high;
  }

  /**
   * The run has become another one; who saw all of it still does.
   * @param {Range} run
   */
  setRun(run) {
    if (run.low === this.#run.low && run.high === this.#run.high) return;
    const { isWhole } = this;
    this.#run = run;
    this.#whole = wholeOf(run);
    if (isWhole) this.#see(this.#whole.low, this.#whole.high);
    else this.#see(this.value.low, this.value.high);
  }

  /** Everything, and from here on the robot is followed again. */
  showWhole() {
    this.#isMoved = false;
    this.#see(this.#whole.low, this.#whole.high);
  }

  /** @param {number} factor of the span, below 1 comes closer; what is at `aboutMm` stays there */
  zoom(factor, aboutMm = (this.value.low + this.value.high) / 2) {
    const span = Math.max(this.span * factor, LEAST_SPAN_MM);
    const low = aboutMm - ((aboutMm - this.value.low) * span) / this.span;
    this.#see(low, low + span);
  }

  /** A person moves it: the robot is no longer followed. */
  pan(mm) {
    this.#isMoved = true;
    this.#see(this.value.low + mm, this.value.high + mm);
  }

  /** Moves along with the robot, unless a person has moved it. */
  follow(mm) {
    if (this.#isMoved) return;
    const margin = FOLLOW_MARGIN * this.span;
    const { low, high } = this.value;
    if (mm > high - margin) this.#see(mm + margin - this.span, mm + margin);
    else if (mm < low + margin) this.#see(mm - margin, mm - margin + this.span);
  }

  /** From here on the robot is followed again. */
  letFollow() {
    this.#isMoved = false;
  }

  /** Brings a distance into sight, in the middle, if it is not. */
  reveal(mm) {
    if (!this.holds(mm)) this.#see(mm - this.span / 2, mm + this.span / 2);
  }

  /** Kept within the run: first as long as asked for, then where it was asked for. */
  #see(low, high) {
    const { low: least, high: most } = this.#whole;
    const span = Math.min(high - low, most - least);
    const from = Math.min(Math.max(low, least), most - span);
    if (from !== this.value.low || from + span !== this.value.high) {
      this.set({ low: from, high: from + span });
    }
  }
}

function wholeOf({ low, high }) {
  const far = Math.max(high, 1000);
  const step = roundStep((far - low) / WHOLE_STEPS);
  // A robot that stands at the zero point may read a little less than nothing.
  return { low: low < -20 ? Math.floor(low / step) * step : 0, high: Math.ceil(far / step - 1e-9) * step };
}

/** The next larger of 1, 2 and 5 times a power of ten of the shown unit, in mm. */
function roundStep(mm) {
  const shown = toShown(mm / 1000);
  const power = 10 ** Math.floor(Math.log10(shown));
  const step = [1, 2, 5, 10].find((size) => size * power >= shown * (1 - 1e-9)) * power;
  return fromShown(step) * 1000;
}

/**
 * Round distances within a range, for an axis.
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

/** Where distances lie across a strip `width` units wide, the same in all strips. */
export class Plot {
  static RIGHT = 22;
  static NARROW = 560;

  /**
   * @param {Range} range
   * @param {number} width
   */
  constructor({ low, high }, width) {
    this.low = low;
    this.left = width < Plot.NARROW ? 26 : 92;
    this.right = width - Plot.RIGHT;
    this.width = Math.max(1, this.right - this.left);
    this.mmPerUnit = (high - low) / this.width;
  }

  get isNarrow() {
    return this.left < 40;
  }

  toX(mm) {
    return this.left + (mm - this.low) / this.mmPerUnit;
  }

  toMm(x) {
    return this.low + (x - this.left) * this.mmPerUnit;
  }
}
