/** What is drawn on a map of assets: graticule, lines, marks, clusters, scale bar, north. */

import { metresPerPx, placeIn, scaleAt, scaleBar, toDegrees, toWorld } from '../../../core/wall/mercator.js';
import { count, lengthUnit } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { drawScaleBar, strokeOnHalo, textOnHalo } from '../../distance/strip/scale-bar.js';
import { drawSeverity } from '../../shared/severity-mark/severity-mark.js';

const MARK_PX = 20;
const CLUSTER_PX = 26;
/** A shorter line is hidden by its mark. */
const LEAST_LINE_PX = 12;
const GRATICULE_PX = 140;
/** Degrees between the lines of a graticule. */
const STEPS = [60, 30, 10, 5, 2, 1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001];
const BAR_PX = 140;
const EDGE_PX = 12;

/**
 * @typedef {object} Sheet what is drawn on
 * @property {CanvasRenderingContext2D} context
 * @property {CSSStyleDeclaration} styles
 * @property {import('../../../core/wall/mercator.js').View} view
 * @property {import('../../../core/wall/mercator.js').Size} size
 */

/** Draws what lies below the assets: tiles, or a plan on paper where there are none. */
export function paintBackground(sheet, tiles) {
  const { context, styles, size } = sheet;
  context.fillStyle = styles.getPropertyValue(tiles ? '--sunken' : '--surface');
  context.fillRect(0, 0, size.width, size.height);
  if (tiles) tiles.paint(sheet);
  else paintGraticule(sheet);
}

/** Draws lines of longitude and latitude with their degrees. */
function paintGraticule({ context, styles, view, size }) {
  const perDegree = scaleAt(view.zoom) / 360;
  const step = STEPS.findLast((degrees) => degrees * perDegree >= GRATICULE_PX) ?? STEPS[0];
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const [middle, lat] = toDegrees([view.x, view.y]);
  const across = size.width / 2 / perDegree;
  const down = size.height / 2 / perDegree; // degrees of latitude are wider elsewhere than at the equator
  const lines = (from, to) => {
    const first = Math.ceil(from / step);
    return Array.from({ length: Math.max(0, Math.floor(to / step) - first + 1) }, (_, i) => (first + i) * step);
  };
  context.lineWidth = 1;
  context.setLineDash([1, 5]);
  context.strokeStyle = styles.getPropertyValue('--line-strong');
  context.fillStyle = styles.getPropertyValue('--text-dim');
  context.font = `11px ${styles.getPropertyValue('--sans')}`;
  context.textBaseline = 'top';
  context.textAlign = 'left';
  context.beginPath();
  for (const lon of lines(middle - across, middle + across)) {
    const x = Math.round(size.width / 2 + (lon - middle) * perDegree) + 0.5;
    context.moveTo(x, 0);
    context.lineTo(x, size.height);
    context.fillText(
      degreesText(((((lon + 180) % 360) + 360) % 360) - 180, decimals, t('map.east'), t('map.west')),
      x + 4,
      4,
    );
  }
  context.textAlign = 'right';
  for (const parallel of lines(Math.max(lat - down, -85), Math.min(lat + down, 85))) {
    const y = Math.round(placeIn(view, size, [view.x, toWorld([0, parallel])[1]])[1]) + 0.5;
    if (y < 0 || y > size.height) continue;
    context.moveTo(0, y);
    context.lineTo(size.width, y);
    context.fillText(degreesText(parallel, decimals, t('map.north'), t('map.south')), size.width - 4, y + 3);
  }
  context.stroke();
  context.setLineDash([]);
}

function degreesText(degrees, decimals, positive, negative) {
  const number = Math.abs(degrees).toFixed(decimals);
  const hasSide = ![0, 180].includes(Number(number));
  return `${number}°${hasSide ? ` ${degrees > 0 ? positive : negative}` : ''}`;
}

/** Draws the lines of the places that are long enough to be seen. */
export function paintLines(sheet, places) {
  const { context, styles, view, size } = sheet;
  const scale = scaleAt(view.zoom);
  const paths = new Map();
  for (const place of places) {
    const reach = place.reach * scale;
    if (2 * reach < LEAST_LINE_PX) continue;
    const [x, y] = placeIn(view, size, [place.x, place.y]);
    if (x < -reach || y < -reach || x > size.width + reach || y > size.height + reach) continue;
    const severity = place.asset.worst_severity ?? 'none';
    if (!paths.has(severity)) paths.set(severity, new Path2D());
    traceLine(paths.get(severity), place, [x, y], scale);
  }
  context.lineCap = 'round';
  context.lineJoin = 'round';
  for (const { width, colourOf } of [
    { width: 7, colourOf: () => '--sunken' },
    { width: 4, colourOf: (severity) => `--severity-${severity}` },
  ]) {
    context.lineWidth = width;
    for (const [severity, path] of paths) {
      context.strokeStyle = styles.getPropertyValue(colourOf(severity));
      context.stroke(path);
    }
  }
}

/** Adds the line of a place whose middle is at (x, y) px to a path. */
function traceLine(path, place, [x, y], scale) {
  place.points.forEach((point, i) => {
    const at = [x + (point[0] - place.x) * scale, y + (point[1] - place.y) * scale];
    if (i === 0) path.moveTo(...at);
    else path.lineTo(...at);
  });
}

/**
 * Draws the marks of clusters.
 * @param {import('./places.js').Cluster[]} clusters
 * @returns {{cluster: import('./places.js').Cluster, x: number, y: number, reach: number}[]} those in view, in px
 */
export function paintMarks(sheet, clusters) {
  const { view, size } = sheet;
  const marks = [];
  for (const cluster of clusters) {
    const [x, y] = placeIn(view, size, [cluster.x, cluster.y]);
    if (x < -MARK_PX || y < -MARK_PX || x > size.width + MARK_PX || y > size.height + MARK_PX) continue;
    marks.push({ cluster, x, y, reach: MARK_PX / 2 });
  }
  // The worst come first and lie on top.
  for (const mark of marks.toReversed()) mark.reach = paintMark(sheet, mark);
  return marks;
}

/** Draws one mark; returns half of its width. */
function paintMark({ context, styles }, { cluster, x, y }) {
  const { severity, places } = cluster;
  if (places.length === 1) {
    drawSeverity(context, severity, x, y, MARK_PX, styles);
    return MARK_PX / 2;
  }
  const text = count(places.length);
  context.font = `650 12px ${styles.getPropertyValue('--sans')}`;
  const width = CLUSTER_PX + context.measureText(text).width + 8;
  context.beginPath();
  context.roundRect(x - width / 2, y - CLUSTER_PX / 2, width, CLUSTER_PX, CLUSTER_PX / 2);
  context.fillStyle = styles.getPropertyValue('--surface');
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = styles.getPropertyValue(`--severity-${severity ?? 'none'}`);
  context.stroke();
  drawSeverity(context, severity, x - width / 2 + CLUSTER_PX / 2 + 1, y, MARK_PX - 4, styles);
  context.fillStyle = styles.getPropertyValue('--text');
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  context.fillText(text, x - width / 2 + CLUSTER_PX - 1, y + 0.5);
  return width / 2;
}

/** Draws a ring around a mark. */
export function paintHighlight({ context, styles }, { x, y, reach }) {
  context.strokeStyle = styles.getPropertyValue('--accent');
  context.lineWidth = 3;
  context.beginPath();
  const height = Math.min(reach, CLUSTER_PX / 2) + 4;
  context.roundRect(x - reach - 4, y - height, 2 * reach + 8, 2 * height, height);
  context.stroke();
}

const lookOf = (styles) => ({
  ink: styles.getPropertyValue('--text'),
  halo: styles.getPropertyValue('--ground'),
  font: styles.getPropertyValue('--sans'),
});

/** Draws a length on the ground, true at the middle of the view, in the lower left corner. */
export function paintMapScale({ context, styles, view, size }) {
  const { px, value, unit } = scaleBar(metresPerPx(view), Math.min(BAR_PX, size.width / 3), lengthUnit);
  drawScaleBar(context, lookOf(styles), [EDGE_PX, size.height - EDGE_PX], px, `${count(value)} ${unit}`);
}

/** Draws an arrow to the north in the upper right corner: north is always up. */
export function paintNorth({ context, styles, size }) {
  const [x, top] = [size.width - EDGE_PX - 8, EDGE_PX];
  strokeOnHalo(context, lookOf(styles), () => {
    context.moveTo(x, top + 26);
    context.lineTo(x, top);
    context.moveTo(x - 5, top + 8);
    context.lineTo(x, top);
    context.lineTo(x + 5, top + 8);
  });
  textOnHalo(context, lookOf(styles), t('map.north'), x - 4.5, top + 40);
}
