/** Measuring a defect: takes the clicks on picture, unrolled wall and 3D view until its points are there. */

import { ApiError } from '../../../core/server/api.js';
import { KINDS, MOST_MEASURES, measured, measuredByServer, quantityOf, usualKind } from '../../../core/wall/measure.js';
import { rounded } from '../../../core/wall/rounding.js';
import { Store, listenTo } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';

const toHundredths = (pixel) => pixel.map((part) => rounded(part, 2));

/**
 * @typedef {object} Running
 * @property {string} id of the observation
 * @property {import('../../../core/wall/measure.js').Measure['kind']} kind
 * @property {import('../../../core/wall/measure.js').Point[]} points
 * @property {import('../../../core/wall/measure.js').Figure|null} figure the server's, of these points
 */

/** Its value is a Running, or null while nothing is measured. */
export class Measuring extends Store {
  #desk;
  #signal;

  constructor(desk, signal) {
    super(null);
    this.#desk = desk;
    this.#signal = signal;
    // Escape, and whatever else wants the clicks, ends it.
    listenTo(desk.picking, 'change', signal, () => {
      if (desk.picking.value !== this.#pick) this.set(null);
    });
    listenTo(desk.selection, 'change', signal, () => {
      if (this.value?.id !== desk.selection.value) this.cancel();
    });
  }

  /** Starts with the selected defect and the usual kind of its code. */
  startSelected() {
    const { observations, selection, catalogue, editing } = this.#desk;
    const item = observations.find(selection.value);
    if (!item) {
      this.#desk.fault(t('measure.select_first'));
      return;
    }
    editing.set(true);
    this.start(item.id, usualKind(item, catalogue.row(item.code, item.char1, item.char2)));
  }

  start(id, kind) {
    if ((this.#desk.observations.find(id)?.measures?.length ?? 0) >= MOST_MEASURES) {
      this.#desk.fault(t('measure.too_many', { most: MOST_MEASURES }));
      return;
    }
    this.set({ id, kind, points: [], figure: null });
    this.#desk.picking.set(this.#pick);
  }

  cancel() {
    if (!this.value) return;
    this.set(null);
    this.#desk.picking.set(null);
  }

  /** Takes the last point back. */
  back() {
    const { value } = this;
    if (value?.points.length) this.#have({ ...value, points: value.points.slice(0, -1), figure: null });
  }

  /** Stores the measure with its defect, and states it where the code has a quantity in its unit. */
  async finish() {
    const { id, kind, points } = this.value;
    if (points.length < KINDS[kind].least) return;
    const figure = await this.#figureOf({ kind, points });
    if (this.value?.points !== points || !figure) return; // cancelled or changed meanwhile, or refused
    this.cancel();
    const { observations } = this.#desk;
    const item = observations.find(id);
    if (!item) return;
    const measures = [...(item.measures ?? []), { kind, points }];
    observations.edit(id, { measures, ...this.#quantity(item, kind, figure) });
  }

  /** Returns what the page knows at once of points. */
  sizeOf({ kind, points }) {
    const { wall, track } = this.#desk;
    return (
      wall &&
      measured(
        kind,
        points.map((point) => sightOf(wall, track, point)),
        wall.radius,
      )
    );
  }

  #quantity(item, kind, figure) {
    const { catalogue, wall } = this.#desk;
    const rules = catalogue.row(item.code, item.char1, item.char2);
    const fits = [1, 2]
      .map((n) => [`quant${n}`, quantityOf(kind, figure, rules?.[`unit_q${n}`] ?? null, wall.radius)])
      .filter(([, value]) => value !== null);
    const [found] = [...fits.filter(([name]) => (item[name] ?? null) === null), ...fits];
    return found ? { [found[0]]: found[1] } : {};
  }

  #pick = ({ frame, pixel }) => {
    const { value } = this;
    if (value.points.length === KINDS[value.kind].most) return; // a double click, while the last one is being stored
    const points = [...value.points, { frame, pixel: toHundredths(pixel) }];
    const isComplete = points.length === KINDS[value.kind].most;
    this.#have({ ...value, points, figure: null }, isComplete);
    if (isComplete) this.finish();
  };

  #have(running, isComplete = false) {
    this.set(running);
    if (!isComplete && running.points.length >= KINDS[running.kind].least) this.#askFor(running);
  }

  async #askFor(running) {
    const figure = await this.#figureOf(running);
    if (this.value === running) this.set({ ...running, figure });
  }

  /** Returns the server's figure; the page's own while the server is out of reach. */
  async #figureOf({ kind, points }) {
    try {
      return await measuredByServer(this.#desk.inspection.id, { kind, points }, this.#signal);
    } catch (error) {
      if (error.name === 'AbortError') return null;
      if (!(error instanceof ApiError)) throw error;
      if (error.isTemporary) return this.sizeOf({ kind, points });
      this.#desk.fault(error);
      return null;
    }
  }
}

/** Returns the sight of a point, null where its frame is not tracked or its pixel shows no wall. */
export function sightOf(wall, track, { frame, pixel }) {
  const row = track.row(frame);
  return row && wall.sight(...pixel, row);
}
