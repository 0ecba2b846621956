/**
 * The fields of the rig file in a form. Bounds are those of `vo_core.rig`; a test
 * compares the two.
 */

import { t } from '../../../core/page/words.js';

/**
 * @typedef {object} Field
 * @property {string} path
 * @property {'number'|'integer'|'numbers'|'choice'} kind numbers: a list
 * @property {string} label
 * @property {string} [unit]
 * @property {number} [min]
 * @property {number} [above] a bound that is not allowed itself
 * @property {number} [max]
 * @property {boolean} [optional] whether it may stay empty
 * @property {string} [help]
 * @property {[string, string][]} [options] of a choice: value, word
 *
 * @typedef {{name: string, title: string, help?: string, fields: Field[]}} Group
 */

/** @type {Group[]} */
export const GROUPS = [
  {
    name: 'pipe',
    title: t('rig.group_pipe'),
    fields: [
      {
        path: 'pipe.shape',
        kind: 'choice',
        label: t('rig.shape'),
        options: [
          ['circular', t('rig.shape_circular')],
          ['flat', t('rig.shape_flat')],
        ],
        help: t('rig.shape_help'),
      },
      {
        path: 'pipe.diameter_mm',
        kind: 'number',
        label: t('rig.diameter'),
        unit: 'mm',
        min: 50,
        max: 20000,
        help: t('rig.diameter_help'),
      },
      {
        path: 'pipe.segment_length_mm',
        kind: 'number',
        label: t('rig.segment'),
        unit: 'mm',
        min: 100,
        max: 20000,
        optional: true,
        help: t('rig.segment_help'),
      },
    ],
  },
  {
    name: 'mount',
    title: t('rig.group_mount'),
    fields: [
      {
        path: 'mount.view',
        kind: 'choice',
        label: t('rig.view'),
        options: [
          ['down', t('rig.view_down')],
          ['forward', t('rig.view_forward')],
        ],
        help: t('rig.view_help'),
      },
      {
        path: 'mount.height_mm',
        kind: 'number',
        label: t('rig.height'),
        unit: 'mm',
        above: 0,
        max: 10000,
        help: t('rig.height_help'),
      },
      {
        path: 'mount.rotation_deg',
        kind: 'number',
        label: t('rig.rotation'),
        unit: '°',
        min: -360,
        max: 360,
        help: t('rig.rotation_help'),
      },
    ],
  },
  {
    name: 'camera',
    title: t('rig.group_camera'),
    fields: [
      {
        path: 'camera.model',
        kind: 'choice',
        label: t('rig.model'),
        options: [
          ['pinhole', t('rig.model_pinhole')],
          ['fisheye', t('rig.model_fisheye')],
        ],
        help: t('rig.model_help'),
      },
      { path: 'camera.width', kind: 'integer', label: t('rig.width'), unit: 'px', min: 32, max: 8192 },
      { path: 'camera.height', kind: 'integer', label: t('rig.picture_height'), unit: 'px', min: 32, max: 8192 },
      {
        path: 'camera.fx',
        kind: 'number',
        label: t('rig.fx'),
        unit: 'px',
        above: 1,
        max: 100000,
        help: t('rig.fx_help'),
      },
      { path: 'camera.fy', kind: 'number', label: t('rig.fy'), unit: 'px', above: 1, max: 100000 },
      {
        path: 'camera.cx',
        kind: 'number',
        label: t('rig.cx'),
        unit: 'px',
        min: -8192,
        max: 16384,
        help: t('rig.cx_help'),
      },
      { path: 'camera.cy', kind: 'number', label: t('rig.cy'), unit: 'px', min: -8192, max: 16384 },
    ],
  },
];

/** @type {Group} */
const KNOWN = {
  name: 'known',
  title: t('rig.group_known'),
  help: t('rig.known_help'),
  fields: [
    {
      path: 'tolerance.height_mm',
      kind: 'number',
      label: t('rig.known_height'),
      unit: 'mm',
      min: 0,
      max: 1000,
      optional: true,
      help: t('rig.known_usual', { usual: '2 mm' }),
    },
    {
      path: 'tolerance.focal_percent',
      kind: 'number',
      label: t('rig.known_focal'),
      unit: '%',
      min: 0,
      max: 20,
      optional: true,
      help: t('rig.known_usual', { usual: '0.5 %' }),
    },
    {
      path: 'tolerance.tilt_deg',
      kind: 'number',
      label: t('rig.known_tilt'),
      unit: '°',
      min: 0,
      max: 30,
      optional: true,
      help: t('rig.known_usual', { usual: '1°' }),
    },
    {
      path: 'tolerance.diameter_mm',
      kind: 'number',
      label: t('rig.known_diameter'),
      unit: 'mm',
      min: 0,
      max: 1000,
      optional: true,
      help: t('rig.known_usual', { usual: '3 mm' }),
    },
    {
      path: 'tolerance.segment_length_mm',
      kind: 'number',
      label: t('rig.known_segment'),
      unit: 'mm',
      min: 0,
      max: 1000,
      optional: true,
      help: t('rig.known_usual', { usual: '5 mm' }),
    },
  ],
};

/** @type {Group} */
const FINE = {
  name: 'fine',
  title: t('rig.group_fine'),
  fields: [
    {
      path: 'camera.distortion',
      kind: 'numbers',
      label: t('rig.distortion'),
      min: -1000,
      max: 1000,
      optional: true,
      help: t('rig.distortion_help'),
    },
    { path: 'camera.skew', kind: 'number', label: t('rig.skew'), unit: 'px', min: -1000, max: 1000, optional: true },
    {
      path: 'mount.lateral_mm',
      kind: 'number',
      label: t('rig.lateral'),
      unit: 'mm',
      min: -5000,
      max: 5000,
      optional: true,
      help: t('rig.lateral_help'),
    },
    {
      path: 'mount.pitch_deg',
      kind: 'number',
      label: t('rig.pitch'),
      unit: '°',
      min: -80,
      max: 80,
      optional: true,
      help: t('rig.pitch_help'),
    },
    {
      path: 'mount.roll_deg',
      kind: 'number',
      label: t('rig.roll'),
      unit: '°',
      min: -80,
      max: 80,
      optional: true,
      help: t('rig.roll_help'),
    },
    {
      path: 'camera.readout_ms',
      kind: 'number',
      label: t('rig.readout'),
      unit: 'ms',
      min: 0,
      max: 200,
      optional: true,
      help: t('rig.readout_help'),
    },
  ],
};

/** Collapsed groups: most rigs do not need them. */
export const FOLDED = [KNOWN, FINE];

export const ALL_FIELDS = [...GROUPS, ...FOLDED].flatMap(({ fields }) => fields);

/** What only experts know of a lens; others state it as an angle or in mm. */
export const LENS_PX = ['camera.fx', 'camera.fy', 'camera.cx', 'camera.cy'];

/** Largest ratio of focal length to a side of the picture, as on the server; a larger one is no lens. */
const LONGEST_SIDE = { pinhole: 7.5, fisheye: 12.5 };

const DISTORTION_LENGTHS = { pinhole: [0, 4, 5, 8, 12, 14], fisheye: [0, 4] };

/** Returns an angle turned by some degrees, in [-180, 180). */
export const turned = (degrees, by) => ((((degrees + by + 180) % 360) + 360) % 360) - 180;

/** Returns the value of a field from its text: undefined when it is empty, NaN when it is no number. */
export function parse({ kind }, text) {
  const trimmed = text.trim();
  if (trimmed === '') return undefined;
  if (kind === 'choice') return trimmed;
  if (kind === 'numbers')
    return trimmed
      .split(/[\s,;]+/)
      .filter(Boolean)
      .map(Number);
  return Number(trimmed);
}

/** Returns a sentence about the fault of a value, or null. */
export function fault(field, value) {
  if (value === undefined) return field.optional ? null : t('page.needed');
  if (field.kind === 'choice') return null;
  const numbers = [value].flat();
  const withUnit = (limit) => (field.unit ? `${limit} ${field.unit}` : limit);
  if (numbers.some(Number.isNaN)) return t('rig.fault_number');
  if (field.kind === 'integer' && !Number.isInteger(value)) return t('rig.fault_integer');
  if (numbers.some((number) => number < field.min)) return t('rig.fault_min', { limit: withUnit(field.min) });
  if (numbers.some((number) => number <= field.above)) return t('rig.fault_above', { limit: withUnit(field.above) });
  if (numbers.some((number) => number > field.max)) return t('rig.fault_max', { limit: withUnit(field.max) });
  return null;
}

/**
 * Returns faults between fields: paths and sentences.
 * @param {Record<string, any>} rig
 * @returns {[string, string][]}
 */
export function jointFaults({ camera, mount, pipe }) {
  /** @type {[string, string][]} */
  const faults = [];
  const lengths = DISTORTION_LENGTHS[camera.model] ?? [];
  if (camera.distortion && !lengths.includes(camera.distortion.length)) {
    faults.push([
      'camera.distortion',
      t('rig.fault_distortion', { n: camera.distortion.length, lengths: lengths.slice(1).join(', ') }),
    ]);
  }
  for (const [name, pixels] of [
    ['fx', camera.width],
    ['fy', camera.height],
  ]) {
    const least = pixels / LONGEST_SIDE[camera.model];
    if (camera[name] < least) {
      faults.push([`camera.${name}`, t('rig.fault_focal', { least: Math.ceil(least), pixels, focal: camera[name] })]);
    }
  }
  if (pipe.shape === 'circular') {
    const radius = pipe.diameter_mm / 2;
    if (Math.hypot(mount.lateral_mm ?? 0, radius - mount.height_mm) >= radius) {
      faults.push(['mount.height_mm', t('rig.fault_outside', { diameter: pipe.diameter_mm })]);
    }
  }
  return faults;
}
