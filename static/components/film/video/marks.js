/** Marks of defects in the shown picture, by their points on the wall. */

import { MARK_PX, placeOf } from './overlay-drawing.js';

/** Marks closer than this share of their size are drawn as one: the selected, else the gravest. */
const APART = 1 / 3;

export class Marks {
  #desk;
  /** Wall points by observation; a changed observation is a new object. Cleared when the track restarts. */
  #wallPoints = new WeakMap();
  #generation = 0;

  /** @param {Desk} desk */
  constructor(desk) {
    this.#desk = desk;
  }

  /**
   * Returns the mark within reach of a pixel, or null.
   * @param {[number, number]} pixel
   * @param {number} scale of a video px
   */
  at([u, v], scale) {
    const reach = MARK_PX / 2 / scale;
    return this.inPicture(scale).find(({ pixel }) => Math.hypot(pixel[0] - u, pixel[1] - v) <= reach) ?? null;
  }

  /**
   * Returns the marks of observations whose wall point is in the picture now, merged where they overlap:
   * [{id, severity, code, pixel}].
   */
  inPicture(scale) {
    const { observations, playhead, selection, wall } = this.#desk;
    const { frame, row } = playhead.value;
    if (!row || !wall) return [];
    const rank = ({ id, severity }) => (id === selection.value ? Infinity : (severity ?? -1));
    const shown = new Map();
    const cell = (MARK_PX * APART) / scale;
    for (const item of observations.value) {
      const point = this.#wallPoint(item);
      const pixel = item.frame === frame ? item.pixel : point && wall.pixel(point, row);
      if (!pixel) continue;
      const place = placeOf(pixel, cell, cell);
      const other = shown.get(place);
      if (!other || rank(item) > rank(other)) shown.set(place, { ...item, pixel });
    }
    return [...shown.values()];
  }

  /** Returns the wall point of an observation, or null without a pixel or before its frame is tracked. */
  #wallPoint(item) {
    const { track, wall } = this.#desk;
    if (track.generation !== this.#generation) {
      this.#generation = track.generation;
      this.#wallPoints = new WeakMap();
    }
    const known = this.#wallPoints.get(item);
    if (known !== undefined) return known;
    const row = item.pixel && track.row(item.frame);
    if (!row) return null;
    const found = wall.at(...item.pixel, row);
    this.#wallPoints.set(item, found);
    return found;
  }
}
