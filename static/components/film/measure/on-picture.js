/** What measuring draws over the picture of the film. */

import { clockHour } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { paintMeasure, paintScaleBar, runningMeasure, storedMeasures } from './paint.js';

const BAR_AT = [14, 16];
/** From a measure to the middle of its label. */
const AWAY_PX = 22;
/** Where the scale holds without a pointer, as a share of the height: the middle of a camera that looks ahead is far away. */
const REST_SHARE = { down: 0.5, forward: 0.88 };
/** Greatest length of the scale bar as a share of the picture's width. */
const BAR_SHARE = 0.22;
/** Half of the pixels over which the scale at a place is read. */
const BESIDE_PX = 8;

/**
 * Draws the measures of the selected defect, of those tagged in the shown frame, and the one being made.
 * @param {CanvasRenderingContext2D} context
 * @param {Desk} desk
 * @param {{toStage: Function, layout: object, cursor: [number, number]|null, label: Function, styles: CSSStyleDeclaration}} stage
 */
export function paintOnPicture(context, desk, stage) {
  const { frame, row } = desk.playhead.value;
  if (!desk.wall || !row) return;
  const chosen = desk.observations.value.filter(
    (item) => item.measures && (item.frame === frame || item.id === desk.selection.value),
  );
  const pointer = stage.cursor && { frame, pixel: stage.cursor };
  const drawn = [...storedMeasures(desk, chosen), ...runningMeasure(desk.measuring, pointer)];
  const lowest = stage.toStage([0, desk.inspection.value.video.height - 1])[1] - 3 * AWAY_PX; // the scale bar is below
  const label = (text, x, top, bottom) => stage.label(text, x, bottom < lowest ? bottom + AWAY_PX : top - AWAY_PX);
  for (const one of drawn) {
    const places = one.measure.points.map((point) => {
      const pixel = pixelNow(desk, point, frame, row);
      return pixel && stage.toStage(pixel);
    });
    paintMeasure(context, one, places, label);
  }
  paintScale(context, desk, stage, row);
}

/** Returns where the shown picture has a point of another frame, or null. */
function pixelNow({ wall, track }, point, frame, row) {
  if (point.frame === frame) return point.pixel;
  const seenFrom = track.row(point.frame);
  const place = seenFrom && wall.at(...point.pixel, seenFrom);
  return place && wall.pixel(place, row);
}

/** Draws the scale of one place of the wall, as it differs over the picture: at the pointer, else near the invert. */
function paintScale(context, { wall, inspection }, { toStage, layout, cursor, styles }, row) {
  const { rig, video } = inspection.value;
  const [u, v] = cursor ?? [video.width / 2, video.height * REST_SHARE[rig.mount.view]];
  const ends = [u - BESIDE_PX, u + BESIDE_PX].map((side) => wall.sight(side, v, row));
  const place = wall.at(u, v, row);
  if (ends.includes(null) || !place) return;
  const apartMm = Math.hypot(...[0, 1, 2].map((k) => ends[1].at[k] - ends[0].at[k]));
  const perMm = (toStage([u + BESIDE_PX, v])[0] - toStage([u - BESIDE_PX, v])[0]) / apartMm;
  const [left, bottom] = toStage([0, video.height - 1]);
  const textOf = (size) => {
    const across = cursor ? t('measure.bar_at_pointer', { size }) : t('measure.bar_at_invert', { size });
    return place.clock_h === null ? across : `${across} · ${clockHour(place.clock_h)}`;
  };
  /** @type {[number, number]} */
  const at = [left + BAR_AT[0], bottom - BAR_AT[1]];
  paintScaleBar(context, perMm, at, BAR_SHARE * layout.width * layout.scale, textOf, styles.getPropertyValue('--sans'));
}
