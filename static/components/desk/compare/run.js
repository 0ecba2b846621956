/** One of the two compared runs, with everything that is drawn of it. */

import { get } from '../../../core/server/api.js';
import { Catalogue } from '../../../core/defects/codes.js';
import { Track } from '../../../core/survey/track.js';
import { WallGrid } from '../../../core/wall/wall.js';

export class Run {
  /** @param {string} id @param {AbortSignal} signal */
  static async load(id, signal) {
    const path = `/api/inspections/${id}`;
    const track = new Track(id);
    const [inspection, { observations }, wall] = await Promise.all([
      get(path, signal),
      get(`${path}/observations`, signal),
      WallGrid.load(id, signal),
      track.extend(signal),
    ]);
    const catalogue = await Catalogue.load(signal, inspection.header.code_pack);
    return new Run({ inspection, track, observations, catalogue, wall });
  }

  constructor({ inspection, track, observations, catalogue, wall }) {
    this.id = inspection.id;
    this.path = `/api/inspections/${inspection.id}`;
    this.inspection = inspection;
    this.track = track;
    this.observations = observations;
    this.catalogue = catalogue;
    this.wall = wall;
    const distances = track.column('distance_mm');
    this.low = distances.reduce((least, mm) => Math.min(least, mm), Infinity);
    this.high = distances.reduce((most, mm) => Math.max(most, mm), -Infinity);
    // A film that nobody has looked at yet shows of no defect that it is gone.
    const isLookedAt = observations.length > 0 || inspection.review.state !== 'draft';
    /** Distance of the last frame; null while nothing follows from what the run does not show. */
    this.endMm = isLookedAt ? distances.at(-1) : null;
  }

  /**
   * Returns the defects that a frame shows: [{severity, pixel}].
   * @param {import('../../../core/survey/track.js').Row} row
   */
  marksIn(row) {
    if (!this.wall) return [];
    return this.observations.flatMap(({ frame, pixel, severity }) => {
      const tagged = pixel && this.track.row(frame);
      const point = tagged && this.wall.at(...pixel, tagged);
      const seen = frame === row.frame ? pixel : point && this.wall.pixel(point, row);
      return seen ? [{ severity, pixel: seen }] : [];
    });
  }
}
