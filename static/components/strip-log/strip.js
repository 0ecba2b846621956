/** Common base of the strips along the distance: one axis, its pointer, units that grow with the type. */

import { Plot } from '../../core/axis.js';
import { onThemeChange } from '../../core/screen.js';
import { Component } from '../../core/store.js';
import { stripGestures } from './gestures.js';

/** A strip defines `tap(x, y)` and `stale()`; its part `track` is the drawing. */
export class Strip extends Component {
  /** CSS px in a unit: type and lines grow with the type of the page. */
  scale = 1;
  /** {x, y} of the pointer in units, or null */
  hover = null;

  follow() {
    const { track } = this.parts;
    const { axis } = this.desk;
    stripGestures(
      track,
      axis,
      {
        toMm: (px) => this.plot.toMm(px / this.scale),
        scrub: (px) => this.seekDistance(this.inSight(this.plot.toMm(px / this.scale))),
        tap: (x, y) => this.tap(x / this.scale, y / this.scale),
        hover: (x, y) => this.#point(x === null ? null : { x: x / this.scale, y: y / this.scale }),
      },
      this.signal,
    );
    this.listen(axis.pointer, 'change', () => this.repaint());
    onThemeChange(() => this.stale(), this.signal);
    const resized = new ResizeObserver(() => this.stale(true));
    resized.observe(track);
    this.signal.addEventListener('abort', () => resized.disconnect());
  }

  get plot() {
    return new Plot(this.desk.axis.value, this.parts.track.clientWidth / this.scale);
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

  #point(place) {
    this.hover = place;
    this.desk.axis.pointer.set(place && this.plot.toMm(place.x));
    this.repaint();
  }
}
