/** The cross-section of the pipe with the camera, drawn to scale from the rig. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';

const SIZE = 240;
const DRAWN = 168;
const RADIANS = Math.PI / 180;

/** @param {object} rig may be incomplete; missing parts are not drawn */
export function rigSketch({ camera, mount, pipe }) {
  const isRound = pipe.shape === 'circular';
  const width = isRound ? pipe.diameter_mm : 2.4 * mount.height_mm;
  if (!(width > 0) || !(mount.height_mm > 0)) return blank();

  const scale = DRAWN / width;
  const invert = SIZE / 2 + DRAWN / 2;
  const toX = (mm) => SIZE / 2 + mm * scale;
  const toY = (heightMm) => invert - heightMm * scale;
  const eye = { x: mount.lateral_mm ?? 0, y: mount.height_mm };
  const [left, right] = mount.view === 'down' ? seenWall(camera, mount, eye, isRound ? width / 2 : null) : [];
  const at = ({ x, y }) => `${toX(x).toFixed(1)} ${toY(y).toFixed(1)}`;
  const radius = (width / 2) * scale;
  const wall = isRound ? `A${radius} ${radius} 0 0 0` : 'L';

  return html`<svg class="sketch" viewBox="0 0 ${SIZE} ${SIZE}" role="img" aria-label="${describe(pipe, mount)}">
    ${
      isRound
        ? html`<circle class="sketch__pipe" cx="${SIZE / 2}" cy="${SIZE / 2}" r="${radius}" />`
        : html`<path class="sketch__pipe" d="M10 ${invert}H${SIZE - 10}" />`
    }
    ${
      left &&
      html`<path class="sketch__view" d="M${at(eye)}L${at(left)}${wall} ${at(right)}Z" />
      <path class="sketch__seen" d="M${at(left)}${wall} ${at(right)}" />`
    }
    <path class="sketch__height" d="M${toX(eye.x)} ${toY(eye.y)}V${isRound ? wallBelow(eye, width / 2, toY) : invert}" />
    <g class="sketch__camera">
      <rect x="${toX(eye.x) - 9}" y="${toY(eye.y) - 13}" width="18" height="11" rx="2" />
      ${
        mount.view === 'down'
          ? html`<path d="M${toX(eye.x) - 5} ${toY(eye.y) - 2}h10l2.500 5h-15z" />`
          : html`<circle class="sketch__lens" cx="${toX(eye.x)}" cy="${toY(eye.y) - 7.5}" r="3.500" />`
      }
    </g>
    <text x="${SIZE / 2}" y="16">${isRound ? `Ø ${pipe.diameter_mm} mm` : t('rig.sketch_flat')}</text>
    <text x="${SIZE / 2}" y="${SIZE - 6}">${
      isRound
        ? t('rig.sketch_above_invert', { height: mount.height_mm })
        : t('rig.sketch_above_floor', { height: mount.height_mm })
    }</text>
  </svg>`;
}

function blank() {
  return html`<svg class="sketch" viewBox="0 0 ${SIZE} ${SIZE}" role="img" aria-label="${t('rig.sketch_none')}">
    <circle class="sketch__pipe sketch__pipe--blank" cx="${SIZE / 2}" cy="${SIZE / 2}" r="${DRAWN / 2}" />
    <text x="${SIZE / 2}" y="${SIZE / 2}">${t('rig.sketch_needs')}</text>
    <text x="${SIZE / 2}" y="${SIZE / 2 + 18}">${t('rig.sketch_makes')}</text></svg>`;
}

const describe = (pipe, mount) =>
  pipe.shape === 'circular'
    ? t('rig.sketch_pipe', { diameter: pipe.diameter_mm, height: mount.height_mm })
    : t('rig.sketch_floor', { height: mount.height_mm });

function wallBelow(eye, radius, toY) {
  const drop = Math.sqrt(Math.max(radius ** 2 - eye.x ** 2, 0));
  return toY(radius - drop);
}

/**
 * Returns the two wall points at the edges of the picture, across the pipe; none when the lens is unknown.
 */
function seenWall(camera, mount, eye, radius) {
  const turn = (mount.rotation_deg ?? 0) * RADIANS;
  const across =
    Math.abs(Math.sin(turn)) * (camera.width / camera.fx) + Math.abs(Math.cos(turn)) * (camera.height / camera.fy);
  const half = camera.model === 'fisheye' ? across / 2 : Math.atan(across / 2);
  if (!(half > 0)) return [];
  const roll = (mount.roll_deg ?? 0) * RADIANS;
  const points = [-half, half].map((angle) => hit(eye, Math.min(Math.max(angle - roll, -1.5), 1.5), radius));
  return points.every(Boolean) ? points : [];
}

/** Returns where a ray from `eye`, `angle` to the right of straight down, meets the wall. */
function hit(eye, angle, radius) {
  const [dx, dy] = [Math.sin(angle), -Math.cos(angle)];
  if (radius === null) return { x: eye.x - (eye.y * dx) / dy, y: 0 };
  const [px, py] = [eye.x, eye.y - radius];
  const b = px * dx + py * dy;
  const inside = b * b - (px * px + py * py - radius * radius);
  if (inside < 0) return null;
  const along = -b + Math.sqrt(inside);
  return { x: eye.x + along * dx, y: eye.y + along * dy };
}
