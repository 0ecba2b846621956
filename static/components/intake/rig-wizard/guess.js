/** What the wizard assumes of a rig before somebody states it. */

import { focalDown } from '../../../core/wall/lens.js';

/** Focal length in picture widths: a view of 61°, between a phone's and that of a wide inspection camera. */
const FOCAL_WIDTHS = 0.85;
/** How far a guessed focal length may be off, one sigma. */
const FOCAL_PERCENT = 15;
/** The direction does not depend on the pipe, so any diameter does until one is stated. */
const ANY_DIAMETER_MM = 300;

/**
 * Returns the fields to change so that a rig can be of a camera that looks ahead and made this picture.
 * @param {object} rig of the form, perhaps of another camera or without any values
 * @param {{width: number, height: number, pixel_aspect: number}} picture
 * @returns {{changes: Record<string, string|number>, isLensGuessed: boolean}}
 */
export function changesFor({ camera, mount, pipe }, { width, height, pixel_aspect: aspect }) {
  const changes = { 'pipe.shape': 'circular' };
  if (mount.view !== 'forward') {
    Object.assign(changes, {
      'mount.view': 'forward',
      'mount.rotation_deg': 0,
      'mount.lateral_mm': '',
      'mount.pitch_deg': '',
      'mount.roll_deg': '',
      'mount.height_mm': pipe.diameter_mm > 0 ? pipe.diameter_mm / 2 : '',
    });
  }
  const isLensGuessed = !(camera.width === width && camera.height === height && camera.fx > 0);
  if (isLensGuessed) {
    const focal = Math.round(FOCAL_WIDTHS * width);
    Object.assign(changes, {
      'camera.model': 'pinhole',
      'camera.width': width,
      'camera.height': height,
      'camera.fx': focal,
      'camera.fy': focalDown(focal, aspect),
      'camera.cx': (width - 1) / 2,
      'camera.cy': (height - 1) / 2,
      'camera.distortion': '',
      'camera.skew': '',
      'tolerance.focal_percent': FOCAL_PERCENT,
    });
  }
  return { changes, isLensGuessed };
}

/** Half a corrugation is still being typed. */
const wholeOf = (corrugation) => (corrugation?.pitch_mm && corrugation.depth_mm ? corrugation : undefined);

/** Returns a rig that is complete enough to be aimed. */
export function statedOf({ camera, mount, pipe }) {
  const diameter = pipe.diameter_mm > 0 ? pipe.diameter_mm : ANY_DIAMETER_MM;
  return {
    camera,
    mount: { ...mount, height_mm: mount.height_mm > 0 ? mount.height_mm : diameter / 2 },
    pipe: { shape: 'circular', diameter_mm: diameter, corrugation: wholeOf(pipe.corrugation) },
  };
}
