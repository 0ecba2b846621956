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

/** @returns {Field} */
const choice = (path, label, help, options) => ({ path, kind: 'choice', label, help, options });
/** @returns {Field} */
const number = (path, label, unit, more) => ({ path, kind: 'number', label, unit, ...more });
/** @returns {Field} */
const whole = (path, label, unit, more) => ({ ...number(path, label, unit, more), kind: 'integer' });
/** @returns {Field} */
const optional = (path, label, unit, min, max, help = undefined) =>
  number(path, label, unit, { min, max, optional: true, help });
/** One sigma, and what the server assumes without it. @returns {Field} */
const tolerance = (name, label, unit, max, usual) =>
  optional(`tolerance.${name}`, label, unit, 0, max, t('rig.known_usual', { usual }));

/** @type {Group[]} */
export const GROUPS = [
  {
    name: 'pipe',
    title: t('rig.group_pipe'),
    fields: [
      choice('pipe.shape', t('rig.shape'), t('rig.shape_help'), [
        ['circular', t('rig.shape_circular')],
        ['flat', t('rig.shape_flat')],
      ]),
      number('pipe.diameter_mm', t('rig.diameter'), 'mm', { min: 50, max: 20000, help: t('rig.diameter_help') }),
      optional('pipe.segment_length_mm', t('rig.segment'), 'mm', 100, 20000, t('rig.segment_help')),
      optional('pipe.corrugation.pitch_mm', t('rig.corrugation_pitch'), 'mm', 5, 1000, t('rig.corrugation_help')),
      optional(
        'pipe.corrugation.depth_mm',
        t('rig.corrugation_depth'),
        'mm',
        0.5,
        300,
        t('rig.corrugation_depth_help'),
      ),
    ],
  },
  {
    name: 'mount',
    title: t('rig.group_mount'),
    fields: [
      choice('mount.view', t('rig.view'), t('rig.view_help'), [
        ['down', t('rig.view_down')],
        ['forward', t('rig.view_forward')],
      ]),
      number('mount.height_mm', t('rig.height'), 'mm', { above: 0, max: 10000, help: t('rig.height_help') }),
      number('mount.rotation_deg', t('rig.rotation'), '°', { min: -360, max: 360, help: t('rig.rotation_help') }),
    ],
  },
  {
    name: 'camera',
    title: t('rig.group_camera'),
    fields: [
      choice('camera.model', t('rig.model'), t('rig.model_help'), [
        ['pinhole', t('rig.model_pinhole')],
        ['fisheye', t('rig.model_fisheye')],
      ]),
      whole('camera.width', t('rig.width'), 'px', { min: 32, max: 8192 }),
      whole('camera.height', t('rig.picture_height'), 'px', { min: 32, max: 8192 }),
    ],
  },
];

/** @type {Group} */
const LENS = {
  name: 'lens',
  title: t('lens.by_px'),
  fields: [
    number('camera.fx', t('rig.fx'), 'px', { above: 1, max: 100000, help: t('rig.fx_help') }),
    number('camera.fy', t('rig.fy'), 'px', { above: 1, max: 100000 }),
    number('camera.cx', t('rig.cx'), 'px', { min: -8192, max: 16384, help: t('rig.cx_help') }),
    number('camera.cy', t('rig.cy'), 'px', { min: -8192, max: 16384 }),
  ],
};

/** @type {Group} */
const KNOWN = {
  name: 'known',
  title: t('rig.group_known'),
  help: t('rig.known_help'),
  fields: [
    tolerance('height_mm', t('rig.known_height'), 'mm', 1000, '2 mm'),
    tolerance('focal_percent', t('rig.known_focal'), '%', 20, '0.5 %'),
    tolerance('tilt_deg', t('rig.known_tilt'), '°', 30, '1°'),
    tolerance('diameter_mm', t('rig.known_diameter'), 'mm', 1000, '3 mm'),
    tolerance('segment_length_mm', t('rig.known_segment'), 'mm', 1000, '5 mm'),
  ],
};

/** @type {Group} */
const FINE = {
  name: 'fine',
  title: t('rig.group_fine'),
  fields: [
    {
      ...optional('camera.distortion', t('rig.distortion'), '', -1000, 1000, t('rig.distortion_help')),
      kind: 'numbers',
    },
    optional('camera.skew', t('rig.skew'), 'px', -1000, 1000),
    optional('mount.lateral_mm', t('rig.lateral'), 'mm', -5000, 5000, t('rig.lateral_help')),
    optional('mount.pitch_deg', t('rig.pitch'), '°', -80, 80, t('rig.pitch_help')),
    optional('mount.roll_deg', t('rig.roll'), '°', -80, 80, t('rig.roll_help')),
    optional('camera.readout_ms', t('rig.readout'), 'ms', 0, 200, t('rig.readout_help')),
  ],
};

/** Behind *Expert*: most rigs do not need them. */
export const EXPERT = [LENS, KNOWN, FINE];

export const ALL_FIELDS = [...GROUPS, ...EXPERT].flatMap(({ fields }) => fields);

/** What only experts know of a lens; others state it as an angle or in mm. */
export const LENS_PX = LENS.fields.map(({ path }) => path);

/** Largest ratio of focal length to a side of the picture, as on the server; a larger one is no lens. */
const LONGEST_SIDE = { pinhole: 7.5, fisheye: 12.5 };

const DISTORTION_LENGTHS = { pinhole: [0, 4, 5, 8, 12, 14], fisheye: [0, 4] };

/** Returns the value of a rig at a path such as 'pipe.corrugation.pitch_mm'; undefined where there is none. */
export const valueAt = (rig, path) => path.split('.').reduce((part, name) => part?.[name], rig);

/** Sets the value of a rig at a path; its parts are made where they are missing. */
export function setAt(rig, path, value) {
  const names = path.split('.');
  const last = names.pop();
  names.reduce((part, name) => (part[name] ??= {}), rig)[last] = value;
}

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
  const { pitch_mm: pitch, depth_mm: depth } = pipe.corrugation ?? {};
  if (pitch !== undefined && depth === undefined) faults.push(['pipe.corrugation.depth_mm', t('page.needed')]);
  if (depth !== undefined && pitch === undefined) faults.push(['pipe.corrugation.pitch_mm', t('page.needed')]);
  if (pipe.shape === 'circular') {
    const radius = pipe.diameter_mm / 2;
    if (Math.hypot(mount.lateral_mm ?? 0, radius - mount.height_mm) >= radius) {
      faults.push(['mount.height_mm', t('rig.fault_outside', { diameter: pipe.diameter_mm })]);
    }
  }
  return faults;
}
