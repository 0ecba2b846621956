/** The lanes of the strip log: height, drawing and read-out of each. */

import { USUAL_LIMIT_M_PER_MIN, namesOf } from '../../../core/survey/health.js';
import { chainage, plusMinus, signed, speed, toShown } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { numberEvery, paintMark, paintStretch } from './paint.js';
import { drawComplaint } from './complaint-signs.js';

export const MARK_PX = 18;

const MARK_ROW = 13;
const STRETCH_ROW = 27;
const COMPLAINT_ROW = 15;
const NUMBER_EVERY_PX = 26;
/** By the rank of the status. */
const STATUS_COLOURS = ['--ok', '--weak', '--lost'];
const LOST = 2;

/**
 * @typedef {object} Scene what the lanes draw from; lengths of the drawing are units of 1/16 rem
 * @property {CanvasRenderingContext2D} context
 * @property {(name: string) => string} colour
 * @property {CSSStyleDeclaration} styles
 * @property {import('../../../core/wall/axis.js').Plot} plot
 * @property {number} pixels of the screen in one unit
 * @property {Record<string, import('./columns.js').Band>} bands `rank` is that of the status; complaints by name
 * @property {object} scales {speed, lateral_mm, yaw_deg, counter_mm}: the largest value of the lane
 * @property {object[]} observations
 * @property {import('../../../core/defects/stretches.js').Stretch[]} stretches
 * @property {string|null} selected
 * @property {import('../../../core/wall/joints.js').Joint[]} joints
 * @property {string[]} complaints the kinds that occur
 * @property {import('./columns.js').Band|null} counter by how many mm the counter is ahead of the camera
 * @property {{kind: string, from_mm: number, to_mm: number}[]} counterFaults
 *
 * @typedef {object} Lane
 * @property {string} name
 * @property {(complaints: string[], isLow: boolean) => number} height isLow: room is scarce
 * @property {(scene: Scene, top: number, height: number) => void} paint
 * @property {(scales: object) => string} [scale] its range, for the margin
 * @property {(values: object) => string|null} [read] its value at a frame
 */

const valueHeight = (_, isLow) => (isLow ? 14 : 28);

/** @type {Lane[]} */
export const LANES = [
  { name: 'defects', height: (_, isLow) => (isLow ? 31 : 36), paint: paintDefects },
  {
    name: 'joints',
    height: (_, isLow) => (isLow ? 14 : 17),
    paint: paintJoints,
    read: ({ joint }) => joint && jointText(joint),
  },
  {
    name: 'counter',
    height: (_, isLow) => (isLow ? 26 : 44),
    paint: paintCounter,
    scale: ({ counter_mm: most }) => `± ${most >= 100 ? `${most / 1000} m` : `${most} mm`}`,
    read: ({ counter }) => counter && counterText(counter),
  },
  {
    name: 'quality',
    height: valueHeight,
    paint: paintQuality,
    read: ({ row }) => `${Math.round(100 * row.quality)} %, ${wordFor('strip', row.status)}`,
  },
  {
    name: 'speed',
    height: valueHeight,
    paint: paintSpeed,
    scale: ({ speed: most }) => speedScale(most),
    read: (values) => speed(values.speed),
  },
  {
    name: 'lateral',
    height: valueHeight,
    paint: (scene, top, height) => paintBand(scene, top, height, scene.bands.lateral, scene.scales.lateral_mm),
    scale: ({ lateral_mm: most }) => `± ${most} mm`,
    read: ({ row }) => `${signed(row.y_mm, 1)} mm`,
  },
  {
    name: 'yaw',
    height: valueHeight,
    paint: (scene, top, height) => paintBand(scene, top, height, scene.bands.yaw, scene.scales.yaw_deg),
    scale: ({ yaw_deg: most }) => `± ${most}°`,
    read: ({ row }) => `${signed(row.yaw_deg, 2)}°`,
  },
  {
    name: 'health',
    height: (complaints) => COMPLAINT_ROW * Math.max(1, complaints.length) + 2,
    paint: paintHealth,
    read: ({ complaints }) => complaintText(complaints),
  },
];

export const laneWord = (name) => wordFor('strip_lane', name);

const speedScale = (most) => `0–${Math.round(toShown(most))} ${speed(0).split(' ')[1]}`;

export const jointText = ({ number, distance_m: distanceM, u95_m: u95M }) =>
  u95M === null
    ? t('strip.joint_expected', { number, where: chainage(distanceM) })
    : t('strip.joint', { number: number ?? '–', where: `${chainage(distanceM)} ${plusMinus(u95M)}` });

const counterText = ({ m, ahead_mm: mm, faults }) =>
  Number.isNaN(mm)
    ? t('strip.counter_illegible')
    : [
        t('strip.counter', { counter: chainage(m), ahead: `${mm > 0 ? '+' : ''}${chainage(mm / 1000)}` }),
        ...faults.map(({ kind }) => wordFor('counter_fault', kind)),
      ].join(', ');

const complaintText = (bits) =>
  bits
    ? namesOf(bits)
        .map((name) => wordFor('complaint', name))
        .join(', ')
    : t('strip.no_complaint');

/** Fills a lane's ground. */
export function paintGround({ context, colour, plot }, top, height) {
  context.fillStyle = colour('--raised');
  context.fillRect(plot.left, top, plot.width, height);
}

/** Runs `paint` in whole pixels of the screen: fractions would leave seams between the columns. */
function inPixels({ context, plot, pixels }, top, height, paint) {
  const [left, from, to] = [plot.left, top, top + height].map((value) => Math.round(value * pixels));
  context.save();
  context.resetTransform();
  context.beginPath();
  context.rect(left, from, Math.round(plot.width * pixels), to - from);
  context.clip();
  paint(left, from, to - from);
  context.restore();
}

function paintDefects(scene, top) {
  const { context, colour, plot, observations, stretches, selected, styles } = scene;
  const inSight = (from, to = from) => to >= plot.left - MARK_PX && from <= plot.right + MARK_PX;
  clipTo(context, plot.left, top, plot.width, 60);
  for (const stretch of stretches) {
    if (!inSight(...[stretch.from_m, stretch.to_m].map((m) => plot.toX(m * 1000)))) continue;
    paintStretch(context, styles, plot, stretch, top + STRETCH_ROW, 5, colour('--raised'));
  }
  context.restore();
  clipTo(context, plot.left - MARK_PX, top - 6, plot.width + 2 * MARK_PX, 60);
  context.font = `600 11px ${colour('--sans')}`;
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  const shown = observations.filter(({ distance_m: m }) => m !== null && inSight(plot.toX(m * 1000)));
  const xs = shown.map(({ distance_m: m }) => plot.toX(m * 1000));
  shown.forEach((item, i) => {
    const [x, y] = [xs[i], top + MARK_ROW];
    paintInterval(context, colour, plot, item, x, top + MARK_ROW + 11);
    paintMark(context, styles, item, x, y, MARK_PX, item.id === selected);
    if (!item.code) return;
    const room = Math.min(xs[i + 1] ?? plot.right + 20, plot.right + 20) - x - MARK_PX - 3;
    if (room <= 0 || context.measureText(item.code).width > room) return;
    context.fillStyle = colour('--text-dim');
    context.fillText(item.code, x + MARK_PX / 2 + 3, y + 0.5);
  });
  context.restore();
}

function clipTo(context, left, top, width, height) {
  context.save();
  context.beginPath();
  context.rect(left, top, width, height);
  context.clip();
}

/** Draws the 95 % interval as a thin line with ends, where it is wider than the mark's own stem. */
function paintInterval(context, colour, plot, { distance_u95_m: u95M }, x, y) {
  const half = u95M === null ? 0 : (u95M * 1000) / plot.mmPerUnit;
  context.strokeStyle = colour('--text-dim');
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x, y + 4);
  if (half >= 1) {
    context.moveTo(x - half, y);
    context.lineTo(x + half, y);
    for (const end of [x - half, x + half]) {
      context.moveTo(end, y - 2.5);
      context.lineTo(end, y + 2.5);
    }
  }
  context.stroke();
}

function paintJoints({ context, colour, plot, joints }, top, height) {
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  context.font = `600 11px ${colour('--sans')}`;
  const every = numberEvery(joints, plot, NUMBER_EVERY_PX);
  for (const { number, distance_m: m, u95_m: u95M } of joints) {
    const x = plot.toX(m * 1000);
    if (x < plot.left || x > plot.right) continue;
    const isFound = u95M !== null;
    context.fillStyle = colour(isFound ? '--text' : '--line-strong');
    if (isFound) {
      context.globalAlpha = 0.25;
      const half = Math.max(1, (u95M * 1000) / plot.mmPerUnit);
      context.fillRect(x - half, top + 2, 2 * half, height - 4);
      context.globalAlpha = 1;
    }
    if (isFound) context.fillRect(Math.round(x) - 0.5, top + 2, 1.5, height - 4);
    else for (let y = top + 2; y < top + height - 2; y += 5) context.fillRect(Math.round(x) - 0.5, y, 1, 2.5);
    if (number === null || number % every) continue;
    context.fillStyle = colour(isFound ? '--text' : '--text-dim');
    context.fillText(isFound ? String(number) : `${number}?`, x + 4, top + height / 2 + 0.5);
  }
}

function paintQuality(scene, top, height) {
  const { context, colour, bands, pixels } = scene;
  const ranks = bands.rank.greatest;
  inPixels(scene, top, height, (left, from, tall) => {
    const bar = Math.round(2 * pixels);
    ranks.forEach((rank, i) => {
      if (rank < 0) return; // no frames
      context.fillStyle = colour(STATUS_COLOURS[rank]);
      context.globalAlpha = rank === 0 ? 0.55 : 0.9;
      const size = Math.round(Math.max(3 * pixels, bands.quality.least[i] * tall));
      context.fillRect(left + i, from + tall - size, 1, size);
      if (rank !== LOST) return;
      // Lost is hatched over the whole height: recognisable without colour too.
      context.globalAlpha = Math.floor(i / bar) % 2 ? 0.75 : 0.25;
      context.fillRect(left + i, from, 1, tall);
    });
  });
}

function paintSpeed(scene, top, height) {
  const { context, colour, bands, plot, scales, pixels } = scene;
  const line = Math.round(1.5 * pixels);
  inPixels(scene, top, height, (left, from, tall) => {
    bands.speed.greatest.forEach((speed, i) => {
      if (speed < 0) return; // no frames
      context.fillStyle = colour(speed > USUAL_LIMIT_M_PER_MIN ? '--weak' : '--accent');
      const size = Math.round(Math.min(speed / scales.speed, 1) * tall);
      context.globalAlpha = 0.3;
      context.fillRect(left + i, from + tall - size, 1, size);
      context.globalAlpha = 1;
      context.fillRect(left + i, from + tall - Math.max(size, line), 1, line);
    });
  });
  const y = Math.round(top + height * (1 - USUAL_LIMIT_M_PER_MIN / scales.speed)) + 0.5;
  context.strokeStyle = colour('--text-dim');
  context.lineWidth = 1;
  context.setLineDash([5, 4]);
  context.beginPath();
  context.moveTo(plot.left, y);
  context.lineTo(plot.right, y);
  context.stroke();
  context.setLineDash([]);
}

/**
 * Draws values on either side of a middle line, from the least to the greatest of each column. As on the
 * unrolled wall, right of the axis is below the line; `isUpwards` puts greater values above it.
 */
function paintBand(scene, top, height, band, most, isUpwards = false) {
  const { context, colour, pixels, plot } = scene;
  context.fillStyle = colour('--line-strong');
  context.globalAlpha = isUpwards ? 1 : 0.5;
  context.fillRect(plot.left, Math.round(top + height / 2), plot.width, 1);
  context.globalAlpha = 1;
  const sign = isUpwards ? -1 : 1;
  inPixels(scene, top, height, (left, from, tall) => {
    const toY = (value) => from + tall * (0.5 + (sign * 0.5 * value) / most);
    const line = 1.5 * pixels;
    context.fillStyle = colour('--accent');
    band.least.forEach((least, i) => {
      if (band.isEmpty(i)) return;
      const [one, other] = [toY(least), toY(band.greatest[i])];
      const size = Math.max(line, Math.abs(other - one));
      context.fillRect(left + i, Math.round(Math.min(one, other) - line / 2), 1, Math.round(size));
    });
  });
}

/** Draws a row for each kind that occurs: a bar along the stretch, its sign at the start. */
function paintHealth(scene, top) {
  const { context, colour, bands, complaints, plot, pixels } = scene;
  complaints.forEach((name, row) => {
    const y = top + 1 + row * COMPLAINT_ROW;
    for (const [from, to] of runsOf(bands[name])) {
      const [left, right] = [from, to].map((column) => plot.left + column / pixels);
      context.fillStyle = colour('--weak');
      context.globalAlpha = 0.35;
      context.beginPath();
      context.roundRect(left, y + 1, Math.max(2, right - left), COMPLAINT_ROW - 2, 3);
      context.fill();
      context.globalAlpha = 1;
      drawComplaint(context, name, Math.min(left, plot.right - 13) + 1, y + 1, 13, colour('--text'));
    }
  });
}

/** Returns the ranges of columns with a complaint, closing invisible gaps: [from, to) in columns. */
function runsOf(band) {
  const runs = [];
  const gap = 14;
  band.greatest.forEach((isThere, i) => {
    if (!(isThere > 0)) return;
    const last = runs.at(-1);
    if (last && i - last[1] <= gap) last[1] = i + 1;
    else runs.push([i, i + 1]);
  });
  return runs;
}

/**
 * Draws how far the counter is ahead of the camera, which is the middle line, with its faults: where it stuck or
 * slipped a shaded stretch, where it was set anew a line.
 */
function paintCounter(scene, top, height) {
  const { context, colour, plot, counter, counterFaults: faults, scales } = scene;
  if (!counter) return;
  clipTo(context, plot.left, top, plot.width, height);
  for (const { kind, from_mm: from, to_mm: to } of faults) {
    const [left, right] = [from, to].map((mm) => plot.toX(mm));
    if (kind === 'reset') continue;
    context.fillStyle = colour('--weak');
    context.globalAlpha = kind === 'stuck' ? 0.45 : 0.25;
    context.fillRect(left, top, Math.max(2, right - left), height);
    context.globalAlpha = 1;
  }
  context.restore();
  paintBand(scene, top, height, counter, scales.counter_mm, true);
  paintFaultNames(scene, top, height);
}

function paintFaultNames({ context, colour, plot, counterFaults: faults }, top, height) {
  clipTo(context, plot.left, top, plot.width, height);
  context.font = `600 10px ${colour('--sans')}`;
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  let free = plot.left;
  for (const { kind, from_mm: from } of faults) {
    const x = plot.toX(from);
    context.fillStyle = colour('--text');
    if (kind === 'reset') for (let y = top; y < top + height; y += 5) context.fillRect(Math.round(x) - 0.5, y, 1.5, 3);
    const name = wordFor('counter_fault', kind);
    const wide = context.measureText(name).width;
    if (x + 4 < free || x < plot.left || x + 4 + wide > plot.right) continue;
    context.fillText(name, x + 4, top + 7);
    free = x + 4 + wide + 4;
  }
  context.restore();
}
