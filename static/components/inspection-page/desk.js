/** What the parts of the inspection page share: the data, the play head, the selection, tagging. */

import { ApiError, get } from '../../core/api.js';
import { Catalogue } from '../../core/codes.js';
import { Inspection } from '../../core/inspection.js';
import { LiveFeed } from '../../core/live.js';
import { Observations } from '../../core/observations.js';
import { Outbox } from '../../core/outbox.js';
import { Store } from '../../core/store.js';
import { Track } from '../../core/track.js';
import { u95FromSigma } from '../../core/units.js';
import { WallGrid } from '../../core/wall.js';

/** The 3D robot follows the shown frame at this pace. */
const SHOW_EVERY_MS = 66;

/**
 * @typedef {object} Playhead
 * @property {number} frame -1 before the first picture
 * @property {import('../../core/track.js').Row|null} row null where the frame is not tracked
 * @property {boolean} isLive
 */

/** Events: `fault` (detail: a sentence), `tagged` (detail: the observation). */
export class Desk extends EventTarget {
  /** @type {{value: Playhead}} */
  playhead = new Store({ frame: -1, row: null, isLive: false });
  /** @type {{value: string|null}} id of the selected observation */
  selection = new Store(null);
  /** Whether the form of the selected observation is open. */
  editing = new Store(false);
  /** Set by the page: shows a frame. */
  seek = null;

  #shownFrame = -1;
  #showTimer = 0;

  /** Fetches what the page cannot be drawn without. */
  static async open(id, signal) {
    const inspection = new Inspection(id, signal);
    const [outbox, catalogue, wall] = await Promise.all([
      Outbox.open(),
      Catalogue.load(signal),
      loadWall(id, signal),
      inspection.load(),
    ]);
    return new Desk({ inspection, outbox, catalogue, wall }, signal);
  }

  constructor({ inspection, outbox, catalogue, wall }, signal) {
    super();
    this.inspection = inspection;
    this.outbox = outbox;
    this.catalogue = catalogue;
    /** null while the camera sees no wall at all */
    this.wall = wall;
    this.track = new Track(inspection.id);
    this.observations = new Observations(inspection.id, outbox, signal);
    this.live = new LiveFeed(`/api/inspections/${inspection.id}/live`, signal);
    this.playhead.addEventListener('change', () => this.#showIn3d(), { signal });
    this.observations.addEventListener('change', () => this.#dropLostSelection(), { signal });
    this.live.addEventListener('state', () => this.#showIn3d(true), { signal });
  }

  /** The joints of the pipe in mm, as far as `endMm`; empty when the unit length is not known. */
  jointsUpTo(endMm) {
    const length = this.inspection.value.rig.pipe.segment_length_mm;
    if (!length) return [];
    return Array.from({ length: Math.max(0, Math.floor(endMm / length)) }, (_, i) => (i + 1) * length);
  }

  /** Tags a wall point of the shown frame, or its camera position without a pixel. */
  tag({ code = null, pixel = null }) {
    const { frame, row } = this.playhead.value;
    if (!row) {
      this.#fault('This frame has no distance yet. Tag it when tracking has reached it.');
      return;
    }
    const point = pixel && this.wall?.at(...pixel, row);
    const created = this.observations.create(
      { frame, pixel: point ? pixel : null, code },
      {
        distance_m: point ? point.distance_m : row.distance_mm / 1000,
        distance_u95_m: u95FromSigma(row.sigma_distance_mm),
        clock: point?.clock_h ?? null,
        time_s: row.time_s,
      },
    );
    this.selection.set(created.id);
    this.dispatchEvent(new CustomEvent('tagged', { detail: created }));
  }

  tagCentre(code) {
    const { width, height } = this.inspection.value.video;
    this.tag({ code, pixel: [(width - 1) / 2, (height - 1) / 2] });
  }

  /** Selects an observation and shows its frame. */
  goTo(id) {
    this.selection.set(id);
    const item = this.observations.find(id);
    if (item.frame < this.track.length) this.seek(item.frame);
  }

  /** Selects the next observation along the pipe, or the one before. */
  goToNeighbour(direction) {
    const items = this.observations.value;
    if (items.length === 0) return;
    const here = items.findIndex(({ id }) => id === this.selection.value);
    const at = here < 0 ? (direction > 0 ? 0 : items.length - 1) : here + direction;
    this.goTo(items[Math.min(Math.max(at, 0), items.length - 1)].id);
  }

  #showIn3d(isNew = false) {
    const { frame, isLive } = this.playhead.value;
    const wanted = isLive ? null : frame; // null: the robot follows the tracker
    if (isNew) this.#shownFrame = -1;
    if (frame < 0 || wanted === this.#shownFrame || this.#showTimer) return;
    if (this.live.send({ type: 'show', frame: wanted })) this.#shownFrame = wanted;
    this.#showTimer = setTimeout(() => {
      this.#showTimer = 0;
      this.#showIn3d();
    }, SHOW_EVERY_MS);
  }

  #dropLostSelection() {
    const { value: id } = this.selection;
    if (id !== null && !this.observations.find(id)) this.selection.set(null);
  }

  #fault(text) {
    this.dispatchEvent(new CustomEvent('fault', { detail: text }));
  }
}

/** Without a wall in view (a rig that cannot see it) the page goes on without read-out. */
async function loadWall(id, signal) {
  try {
    return new WallGrid(await get(`/api/inspections/${id}/wallgrid`, signal));
  } catch (error) {
    if (error instanceof ApiError && error.status === 422) return null;
    throw error;
  }
}
