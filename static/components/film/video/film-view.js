/** What part of the picture the stage shows: all of it, or an enlarged part. */

import { Store } from '../../../core/page/store.js';

const MOST = 16;

/**
 * @typedef {object} Shown
 * @property {number} zoom 1 shows the whole picture
 * @property {number} u point of the picture in the middle of the stage, as a share of its width
 * @property {number} v the same of its height
 *
 * @typedef {object} Layout where the picture lies within the stage, in the units of the stage's size
 * @property {number} left
 * @property {number} top
 * @property {number} scale of a square px
 * @property {number} width of the picture in square px
 * @property {number} height
 */

const WHOLE = { zoom: 1, u: 0.5, v: 0.5 };

export class FilmView extends Store {
  constructor() {
    super(WHOLE);
  }

  get isWhole() {
    return this.value.zoom === 1;
  }

  showWhole() {
    this.set(WHOLE);
  }

  /** Changes the zoom and keeps the point of the picture at `x`, `y` of the stage where it is. */
  zoomAt(factor, x, y, size, video) {
    const { left, top, scale, width, height } = layoutOf(size, video, this.value);
    const zoom = Math.min(Math.max(this.value.zoom * factor, 1), MOST);
    const next = layoutOf(size, video, { ...this.value, zoom });
    const [u, v] = [(x - left) / scale, (y - top) / scale];
    this.#set(zoom, (u + (size[0] / 2 - x) / next.scale) / width, (v + (size[1] / 2 - y) / next.scale) / height);
  }

  /** Moves the picture by as many units of the stage. */
  move(across, down, size, video) {
    const { scale, width, height } = layoutOf(size, video, this.value);
    const { zoom, u, v } = this.value;
    this.#set(zoom, u - across / (scale * width), v - down / (scale * height));
  }

  #set(zoom, u, v) {
    const inside = (share) => Math.min(Math.max(share, 0), 1);
    this.set(zoom === 1 ? WHOLE : { zoom, u: inside(u), v: inside(v) });
  }
}

/**
 * @param {[number, number]} size of the stage
 * @param {{width: number, height: number}} video in square px
 * @param {Shown} [shown]
 * @returns {Layout}
 */
export function layoutOf([across, down], { width, height }, { zoom, u, v } = WHOLE) {
  const scale = zoom * Math.min(across / width, down / height);
  return {
    left: cornerOf(across, width * scale, u),
    top: cornerOf(down, height * scale, v),
    scale,
    width,
    height,
  };
}

/** Returns the corner of the picture along one side: a picture larger than the stage covers all of it. */
function cornerOf(room, length, share) {
  if (length <= room) return (room - length) / 2;
  return Math.min(Math.max(room / 2 - share * length, room - length), 0);
}

/** Returns the CSS transform, about the stage's corner, of what fills the stage when all is shown. */
export function transformOf(size, video, shown) {
  if (shown.zoom === 1) return '';
  const [whole, part] = [layoutOf(size, video), layoutOf(size, video, shown)];
  const { zoom } = shown;
  return `translate(${part.left - zoom * whole.left}px, ${part.top - zoom * whole.top}px) scale(${zoom})`;
}
