/**
 * The wall under a pixel, by bilinear interpolation in the server's table of exact ray casts at pose 0:
 * accurate enough for a read-out under the cursor. The server computes the stored distance of a tag
 * exactly.
 */

import { ApiError, get } from './api.js';

const RADIANS = Math.PI / 180;

/**
 * @typedef {object} Pose
 * @property {number} x_mm
 * @property {number} y_mm
 * @property {number} yaw_deg
 * @property {number} z_mm down, as soft wheels let it
 * @property {number} pitch_deg nose up
 * @property {number} roll_deg right side down
 *
 * @typedef {object} WallPoint
 * @property {number} distance_m
 * @property {number} right_mm
 * @property {number|null} clock_h null for a flat floor
 */

export class WallGrid {
  #grid;
  /** Distance to the wall below the camera, in mm; null where a camera looks along the pipe. */
  #depth;
  /** Strips of the grid, each with its bounds on the wall, to skip the many defects outside the picture fast. */
  #strips;

  /** Loads the wall of an inspection; null for a rig that sees no wall. */
  static async load(id, signal) {
    try {
      return new WallGrid(await get(`/api/inspections/${id}/wallgrid`, signal));
    } catch (error) {
      if (error instanceof ApiError && error.status === 422) return null;
      throw error;
    }
  }

  /** @param {{cols, rows, u, v, axial_mm, right_mm, down_mm, clock_h}} grid */
  constructor(grid) {
    this.#grid = grid;
    const seen = grid.down_mm.flat().filter((down) => down !== null).sort((a, b) => a - b);
    this.#depth = seen[0] > 0 ? seen[seen.length >> 1] : null;
    this.#strips = stripsOf(grid);
  }

  /**
   * @param {number} u
   * @param {number} v
   * @param {Pose} pose
   * @returns {WallPoint|null} null where the wall is not seen
   */
  at(u, v, pose) {
    const { axial_mm: axial, right_mm: right, down_mm: down, clock_h: clock } = this.#grid;
    const corners = this.#corners(u, v);
    if (!corners || corners.some(({ i, j }) => axial[i][j] === null)) return null;
    const mean = (table) => corners.reduce((sum, { i, j, weight }) => sum + weight * table[i][j], 0);
    const clockH = clock ? meanClock(corners, clock) : null;
    const [x, y] = toWorld([mean(axial), mean(right), mean(down)], clockH, pose);
    return { distance_m: x / 1000, right_mm: y, clock_h: clockH };
  }

  /**
   * Returns the pixel that shows a wall point, or null when it is outside the picture.
   * @param {number} xMm
   * @param {number} yMm
   * @param {Pose} pose
   */
  pixel(xMm, yMm, pose) {
    const [a, r] = fromWorld(xMm, yMm, this.#depth, pose);
    for (const strip of this.#strips) {
      if (!isWithin(strip, a, r)) continue;
      for (const triangle of strip.triangles) {
        const found = isWithin(triangle, a, r) && inTriangle(a, r, ...triangle.corners);
        if (found) return found;
      }
    }
    return null;
  }

  /**
   * Returns the part of the wall in the picture, as points along its border.
   * @param {Pose} pose
   * @returns {{x_mm: number, right_mm: number, clock_h: number|null}[]} without those that see no wall
   */
  outline(pose) {
    const { cols, rows, axial_mm: axial, right_mm: right, down_mm: down, clock_h: clock } = this.#grid;
    const [last, end] = [rows - 1, cols - 1];
    const border = [
      ...Array.from({ length: cols }, (_, j) => [0, j]),
      ...Array.from({ length: rows }, (_, i) => [i, end]),
      ...Array.from({ length: cols }, (_, j) => [last, end - j]),
      ...Array.from({ length: rows }, (_, i) => [last - i, 0]),
    ];
    return border
      .filter(([i, j]) => axial[i][j] !== null)
      .map(([i, j]) => {
        const clockH = clock ? clock[i][j] : null;
        const [x, y] = toWorld([axial[i][j], right[i][j], down[i][j]], clockH, pose);
        return { x_mm: x, right_mm: y, clock_h: clockH };
      });
  }

  #corners(u, v) {
    const { u: us, v: vs } = this.#grid;
    const [j, fu] = cell(us, u);
    const [i, fv] = cell(vs, v);
    if (j < 0 || i < 0) return null;
    return [
      { i, j, weight: (1 - fu) * (1 - fv) },
      { i, j: j + 1, weight: fu * (1 - fv) },
      { i: i + 1, j, weight: (1 - fu) * fv },
      { i: i + 1, j: j + 1, weight: fu * fv },
    ];
  }
}

/** Returns the index of the grid line at or before `value`, and the fraction of the way to the next. */
function cell(lines, value) {
  if (value < lines[0] || value > lines.at(-1)) return [-1, 0];
  let i = 0;
  while (i + 2 < lines.length && lines[i + 1] <= value) i += 1;
  return [i, (value - lines[i]) / (lines[i + 1] - lines[i])];
}

/** Returns the mean on the circle: between 12 and 1 lies 12:30, not 6:30. */
function meanClock(corners, clock) {
  let sine = 0;
  let cosine = 0;
  for (const { i, j, weight } of corners) {
    const angle = (clock[i][j] / 12) * 2 * Math.PI;
    sine += weight * Math.sin(angle);
    cosine += weight * Math.cos(angle);
  }
  const hours = (Math.atan2(sine, cosine) / (2 * Math.PI)) * 12;
  return hours > 0 ? hours : hours + 12;
}

/** Returns the rows of R_z(yaw) R_y(pitch) R_x(roll), right-handed. */
function rotation({ yaw_deg: yaw, pitch_deg: pitch, roll_deg: roll }) {
  const [cz, cy, cx] = [yaw, pitch, roll].map((angle) => Math.cos(angle * RADIANS));
  const [sz, sy, sx] = [yaw, pitch, roll].map((angle) => Math.sin(angle * RADIANS));
  return [
    [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
    [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
    [-sy, cy * sx, cy * cx],
  ];
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/**
 * Returns the outward normal of the wall at a clock position, [ahead, right, down]; of a floor without one.
 */
function normalAt(clockH) {
  const angle = clockH === null ? 0 : (6 - clockH) * 30 * RADIANS;
  return [0, Math.sin(angle), Math.cos(angle)];
}

/**
 * Rotates a wall point of the grid, [ahead, right, down] of the camera, and projects it onto the wall
 * again.
 */
function toWorld(point, clockH, pose) {
  const ray = rotation(pose).map((row) => dot(row, point));
  const normal = normalAt(clockH);
  const stretch = (dot(normal, point) - normal[2] * pose.z_mm) / dot(normal, ray);
  return [pose.x_mm + stretch * ray[0], pose.y_mm + stretch * ray[1]];
}

/**
 * Returns [ahead, right] in the grid, for a wall at this depth below the camera; without a depth, tilt is
 * ignored.
 */
function fromWorld(x, y, depth, pose) {
  if (depth === null) {
    const [along, across] = rotation({ ...pose, pitch_deg: 0, roll_deg: 0 });
    const [dx, dy] = [x - pose.x_mm, y - pose.y_mm];
    return [along[0] * dx + across[0] * dy, along[1] * dx + across[1] * dy];
  }
  const ray = [x - pose.x_mm, y - pose.y_mm, depth - pose.z_mm];
  const rows = rotation(pose);
  const [ahead, right, down] = [0, 1, 2].map((i) => rows.reduce((sum, row, j) => sum + row[i] * ray[j], 0));
  return [(ahead * depth) / down, (right * depth) / down];
}

/** Returns the triangles between neighbours of the grid, in one strip for each row, within their bounds. */
function stripsOf({ cols, rows, u, v, axial_mm: axial, right_mm: right }) {
  const corner = (i, j) => ({ a: axial[i][j], r: right[i][j], u: u[j], v: v[i] });
  const halvesOf = (i, j) => [
    [corner(i, j), corner(i, j + 1), corner(i + 1, j)],
    [corner(i + 1, j + 1), corner(i, j + 1), corner(i + 1, j)],
  ];
  const strips = Array.from({ length: rows - 1 }, (_, i) =>
    Array.from({ length: cols - 1 }, (__, j) => halvesOf(i, j))
      .flat()
      .filter((corners) => corners.every(({ a }) => a !== null))
      .map((corners) => ({ corners, ...boundsOf(corners) })),
  );
  return strips.map((triangles) => ({ triangles, ...boundsOf(triangles.flatMap(({ corners }) => corners)) }));
}

function boundsOf(points) {
  const [ahead, right] = [points.map(({ a }) => a), points.map(({ r }) => r)];
  return {
    aLow: Math.min(...ahead), aHigh: Math.max(...ahead), rLow: Math.min(...right), rHigh: Math.max(...right),
  };
}

const isWithin = ({ aLow, aHigh, rLow, rHigh }, a, r) => a >= aLow && a <= aHigh && r >= rLow && r <= rHigh;

/** Returns the pixel of the wall point (a, r) by barycentric coordinates, or null outside the triangle. */
function inTriangle(a, r, p, q, s) {
  const area = (q.a - p.a) * (s.r - p.r) - (s.a - p.a) * (q.r - p.r);
  if (Math.abs(area) < 1e-9) return null;
  const wq = ((a - p.a) * (s.r - p.r) - (s.a - p.a) * (r - p.r)) / area;
  const ws = ((q.a - p.a) * (r - p.r) - (a - p.a) * (q.r - p.r)) / area;
  if (wq < 0 || ws < 0 || wq + ws > 1) return null;
  return [p.u + wq * (q.u - p.u) + ws * (s.u - p.u), p.v + wq * (q.v - p.v) + ws * (s.v - p.v)];
}

/**
 * Returns the frame that shows a place of the wall best, and its pixel there.
 * @param {string} inspection
 * @param {WallPoint} place
 * @param {number} nearFrame chooses among several passes
 * @param {AbortSignal} signal
 * @returns {Promise<{frame: number, pixel: [number, number]}>}
 */
export function frameShowing(inspection, place, nearFrame, signal) {
  const query = new URLSearchParams({ distance_m: place.distance_m.toFixed(5) });
  if (place.clock_h === null) query.set('y_mm', place.right_mm.toFixed(2));
  else query.set('clock', place.clock_h.toFixed(4));
  if (nearFrame >= 0) query.set('near_frame', String(nearFrame));
  return get(`/api/inspections/${inspection}/frame-at?${query}`, signal);
}
