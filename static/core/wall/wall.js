/**
 * The wall under a pixel: rays of a grid of pixels, interpolated between them, are cast onto the pipe or
 * the floor from any pose. That is accurate enough for a read-out under the cursor; the server computes
 * the stored distance of a tag from the lens itself.
 */

import { ApiError, get } from '../server/api.js';

const RADIANS = Math.PI / 180;
/** The server rounds its rays to 7 digits. */
const ROUNDING = 1e-6;

/**
 * @typedef {object} Pose since the first frame
 * @property {number} x_mm
 * @property {number} y_mm
 * @property {number} yaw_deg
 * @property {number} z_mm down, as soft wheels let it
 * @property {number} pitch_deg nose up
 * @property {number} roll_deg right side down
 *
 * @typedef {[number, number, number]} Vector
 * @typedef {{from: Vector, turn: [Vector, Vector, Vector]}} View where the camera stands, and its rotation
 * @typedef {Api['WallGridOut']} Grid
 * @typedef {{ray: Vector, u: number, v: number}} Corner
 * @typedef {{axis: Vector, cosine: number}} Cone
 *
 * @typedef {object} WallPoint
 * @property {number} distance_m
 * @property {number} right_mm of the pipe's axis, or of the middle of the floor
 * @property {number|null} clock_h null for a flat floor
 */

export class WallGrid {
  #grid;
  /** Rows of the grid in triangles, each in a cone, to skip the many defects outside the picture fast. */
  #strips;

  /**
   * Loads the wall of an inspection; null for a rig that sees no wall.
   * @param {string} id
   * @param {AbortSignal} signal
   */
  static async load(id, signal) {
    try {
      return new WallGrid(await get(`/api/inspections/${id}/wallgrid`, signal));
    } catch (error) {
      if (error instanceof ApiError && error.status === 422) return null;
      throw error;
    }
  }

  /** @param {Grid} grid of the server */
  constructor(grid) {
    this.#grid = grid;
    this.#strips = stripsOf(grid);
  }

  /**
   * @param {number} u
   * @param {number} v
   * @param {Pose} pose
   * @returns {WallPoint|null} null where the wall is not seen
   */
  at(u, v, pose) {
    const ray = this.#ray(u, v);
    return ray && this.#cast(ray, this.#view(pose));
  }

  /** Radius of the pipe in mm, null on a floor. */
  get radius() {
    return this.#grid.radius_mm;
  }

  /**
   * Returns the wall point under a pixel and where the camera stands, as [along, right, down] in mm of the
   * corrected track; null where the wall is not seen.
   * @param {number} u
   * @param {number} v
   * @param {Pose} pose
   */
  sight(u, v, pose) {
    const ray = this.#ray(u, v);
    const view = this.#view(pose);
    const at = ray && this.#meet(ray, view);
    if (!at) return null;
    /** @param {Vector} point @returns {Vector} */
    const corrected = ([x, y, z]) => [
      pose.x_mm + this.#grid.scale * (x - pose.x_mm),
      this.#grid.scale * y,
      this.#grid.scale * z,
    ];
    return { at: corrected(at), from: corrected(view.from) };
  }

  /**
   * Returns the pixel that shows a wall point, or null when it is outside the picture.
   * @param {WallPoint} point
   * @param {Pose} pose
   */
  pixel(point, pose) {
    const { radius_mm: radius } = this.#grid;
    const { from, turn } = this.#view(pose);
    const angle = radius === null ? 0 : angleAt(point.clock_h);
    const [y, z] = radius === null ? [point.right_mm, 0] : [radius * Math.sin(angle), radius * Math.cos(angle)];
    /** @type {Vector} */
    const away = [1000 * point.distance_m - from[0], y - from[1], z - from[2]];
    const sight = unit(vector((k) => turn.reduce((sum, row, i) => sum + row[k] * away[i], 0)));
    for (const strip of this.#strips) {
      if (!isWithin(strip.cone, sight)) continue;
      for (const triangle of strip.triangles) {
        const found = isWithin(triangle.cone, sight) && inTriangle(sight, triangle.corners);
        if (found) return found;
      }
    }
    return null;
  }

  /**
   * Returns the part of the wall in the picture, as points along its border.
   * @param {Pose} pose
   * @returns {WallPoint[]} without those that see no wall
   */
  outline(pose) {
    const { cols, rows, rays } = this.#grid;
    const [last, end] = [rows - 1, cols - 1];
    const view = this.#view(pose);
    const border = [
      ...Array.from({ length: cols }, (_, j) => [0, j]),
      ...Array.from({ length: rows }, (_, i) => [i, end]),
      ...Array.from({ length: cols }, (_, j) => [last, end - j]),
      ...Array.from({ length: rows }, (_, i) => [last - i, 0]),
    ];
    return border.map(([i, j]) => rays[i][j] && this.#cast(rays[i][j], view)).filter((point) => point !== null);
  }

  /**
   * Returns the camera's place, from the axis or the floor, and its rotation, at a pose.
   * @param {Pose} pose
   * @returns {View}
   */
  #view(pose) {
    const { start } = this.#grid;
    return {
      from: [pose.x_mm, start.y_mm + pose.y_mm, start.z_mm + pose.z_mm],
      turn: rotation({
        yaw_deg: start.yaw_deg + pose.yaw_deg,
        pitch_deg: start.pitch_deg + pose.pitch_deg,
        roll_deg: start.roll_deg + pose.roll_deg,
      }),
    };
  }

  /**
   * Returns the ray of a pixel in the robot's axes, not normalised; null outside the lens.
   * @param {number} u
   * @param {number} v
   * @returns {Vector|null}
   */
  #ray(u, v) {
    const { rays } = this.#grid;
    const corners = this.#corners(u, v);
    if (!corners || corners.some(({ i, j }) => rays[i][j] === null)) return null;
    return vector((k) => corners.reduce((sum, { i, j, weight }) => sum + weight * rays[i][j][k], 0));
  }

  /** Returns the wall point that a ray of the robot meets, or null. @param {Vector} ray @param {View} view */
  #cast(ray, view) {
    const at = this.#meet(ray, view);
    const isFloor = this.#grid.radius_mm === null;
    return at && { distance_m: at[0] / 1000, right_mm: at[1], clock_h: isFloor ? null : clockOf(at) };
  }

  /**
   * Returns where a ray of the robot meets the wall, [along, right, down], or null: |o + t d| = R across the axis.
   * @param {Vector} ray
   * @param {View} view
   * @returns {Vector|null}
   */
  #meet(ray, { from, turn }) {
    const { radius_mm: radius } = this.#grid;
    const [x, y, z] = turn.map((row) => dot(row, ray));
    const [, right, down] = from;
    let t = -down / z;
    if (radius !== null) {
      const [a, b] = [y * y + z * z, right * y + down * z];
      t = (Math.sqrt(b * b - a * (right * right + down * down - radius * radius)) - b) / a;
    }
    if (!(t > 0 && t < Infinity)) return null;
    return [from[0] + t * x, right + t * y, down + t * z];
  }

  /** @param {number} u @param {number} v */
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

/**
 * Returns the index of the grid line at or before `value`, and the fraction of the way to the next.
 * @param {number[]} lines
 * @param {number} value
 */
function cell(lines, value) {
  if (value < lines[0] || value > lines.at(-1)) return [-1, 0];
  let i = 0;
  while (i + 2 < lines.length && lines[i + 1] <= value) i += 1;
  return [i, (value - lines[i]) / (lines[i + 1] - lines[i])];
}

/** Returns the angle of a clock position from the invert, to the right. @param {number} clockH */
const angleAt = (clockH) => (6 - clockH) * 30 * RADIANS;

/** Returns the clock position of a point of a pipe, in (0, 12]. @param {Vector} point */
const clockOf = ([, right, down]) => (18 - Math.atan2(right, down) / RADIANS / 30) % 12 || 12;

/**
 * Returns the rows of R_z(yaw) R_y(pitch) R_x(roll), right-handed.
 * @param {{yaw_deg: number, pitch_deg: number, roll_deg: number}} angles
 * @returns {[Vector, Vector, Vector]}
 */
function rotation({ yaw_deg: yaw, pitch_deg: pitch, roll_deg: roll }) {
  const [cz, cy, cx] = [yaw, pitch, roll].map((angle) => Math.cos(angle * RADIANS));
  const [sz, sy, sx] = [yaw, pitch, roll].map((angle) => Math.sin(angle * RADIANS));
  return [
    [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
    [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
    [-sy, cy * sx, cy * cx],
  ];
}

/** @param {Vector} a @param {Vector} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @param {Vector} ray */
const unit = (ray) => vector((k) => ray[k] / Math.hypot(...ray));

/** @param {(k: number) => number} part @returns {Vector} */
const vector = (part) => [part(0), part(1), part(2)];

/** @param {Vector} a @param {Vector} b @returns {Vector} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/**
 * Returns the triangles between neighbours of the grid, in one strip for each row, in their cones.
 * @param {Grid} grid
 */
function stripsOf({ cols, rows, u, v, rays }) {
  /** @param {number} i @param {number} j */
  const corner = (i, j) => ({ ray: rays[i][j], u: u[j], v: v[i] });
  /** @param {number} i @param {number} j */
  const halvesOf = (i, j) => [
    [corner(i, j), corner(i, j + 1), corner(i + 1, j)],
    [corner(i + 1, j + 1), corner(i, j + 1), corner(i + 1, j)],
  ];
  const strips = Array.from({ length: rows - 1 }, (_, i) =>
    Array.from({ length: cols - 1 }, (__, j) => halvesOf(i, j))
      .flat()
      .filter((corners) => corners.every(({ ray }) => ray !== null))
      .map((corners) => ({ corners, cone: coneOf(corners) })),
  );
  return strips
    .filter((triangles) => triangles.length)
    .map((triangles) => ({ triangles, cone: coneOf(triangles.flatMap(({ corners }) => corners)) }));
}

/**
 * Returns the axis of a cone about the rays of some corners, and the cosine of half its opening.
 * @param {Corner[]} corners
 * @returns {Cone}
 */
function coneOf(corners) {
  const axis = unit(vector((k) => corners.reduce((sum, { ray }) => sum + ray[k], 0)));
  return { axis, cosine: Math.min(...corners.map(({ ray }) => dot(ray, axis))) - ROUNDING };
}

/** @param {Cone} cone @param {Vector} ray */
const isWithin = ({ axis, cosine }, ray) => dot(axis, ray) >= cosine;

/**
 * Returns the pixel of a ray that is a sum of the corners' rays, or null outside the triangle.
 * @param {Vector} ray
 * @param {Corner[]} corners
 * @returns {[number, number]|null}
 */
function inTriangle(ray, [p, q, s]) {
  const volume = dot(p.ray, cross(q.ray, s.ray));
  if (Math.abs(volume) < 1e-12) return null;
  const shares = [
    [q, s],
    [s, p],
    [p, q],
  ].map(([one, other]) => dot(ray, cross(one.ray, other.ray)) / volume);
  if (shares.some((share) => share < -ROUNDING)) return null;
  const total = shares[0] + shares[1] + shares[2];
  /** @param {'u'|'v'} name */
  const mean = (name) => [p, q, s].reduce((sum, corner, k) => sum + shares[k] * corner[name], 0) / total;
  return [mean('u'), mean('v')];
}

/**
 * Returns the frame that shows a place of the wall best, and its pixel there.
 * @param {string} inspection
 * @param {WallPoint} place
 * @param {number} nearFrame chooses among several passes
 * @param {AbortSignal} signal
 * @returns {Promise<{frame: number, pixel: [number, number]}|null>} null if no frame shows it
 */
export async function frameShowing(inspection, place, nearFrame, signal) {
  const query = new URLSearchParams({ distance_m: place.distance_m.toFixed(5) });
  if (place.clock_h === null) query.set('y_mm', place.right_mm.toFixed(2));
  else query.set('clock', place.clock_h.toFixed(4));
  if (nearFrame >= 0) query.set('near_frame', String(nearFrame));
  const found = await get(`/api/inspections/${inspection}/frame-at?${query}`, signal);
  return found.frame === null ? null : found;
}
