/**
 * The fields of the rig file as a person fills them in. Bounds are those of `vo_core.rig`; a test
 * compares the two.
 *
 * `kind`: 'number' | 'integer' | 'numbers' (a list) | 'choice'. `optional` fields may stay empty.
 */

export const GROUPS = [
  {
    name: 'pipe',
    title: 'Pipe',
    fields: [
      {
        path: 'pipe.shape', kind: 'choice', label: 'Shape',
        options: [['circular', 'Circular pipe'], ['flat', 'Flat floor']],
        help: 'A box culvert is measured on its flat floor.',
      },
      {
        path: 'pipe.diameter_mm', kind: 'number', label: 'Inner diameter', unit: 'mm', min: 50, max: 20000,
        help: 'Clear width inside, as built.',
      },
      {
        path: 'pipe.segment_length_mm', kind: 'number', label: 'Length of a pipe unit', unit: 'mm',
        min: 100, max: 20000, optional: true,
        help: 'Joint to joint. Draws the joints and numbers them.',
      },
    ],
  },
  {
    name: 'mount',
    title: 'Camera on the robot',
    fields: [
      {
        path: 'mount.view', kind: 'choice', label: 'Looks',
        options: [['down', 'Down'], ['forward', 'Forward']],
        help: 'Down at the invert, or forward along the pipe.',
      },
      {
        path: 'mount.height_mm', kind: 'number', label: 'Height of the lens', unit: 'mm', above: 0, max: 10000,
        help: 'Above the invert or the floor. 1 % wrong here is 1 % of the distance.',
      },
      {
        path: 'mount.rotation_deg', kind: 'number', label: 'Turned by', unit: '°', min: -360, max: 360,
        help: 'About the optical axis. Looking down, 0 has the right edge of the picture in front.',
      },
    ],
  },
  {
    name: 'camera',
    title: 'Camera',
    fields: [
      {
        path: 'camera.model', kind: 'choice', label: 'Lens',
        options: [['pinhole', 'Pinhole'], ['fisheye', 'Fisheye']],
        help: 'Pinhole is the ordinary lens.',
      },
      { path: 'camera.width', kind: 'integer', label: 'Picture width', unit: 'px', min: 32, max: 8192 },
      { path: 'camera.height', kind: 'integer', label: 'Picture height', unit: 'px', min: 32, max: 8192 },
      {
        path: 'camera.fx', kind: 'number', label: 'Focal length fx', unit: 'px', above: 1, max: 100000,
        help: 'From the calibration of the camera.',
      },
      { path: 'camera.fy', kind: 'number', label: 'Focal length fy', unit: 'px', above: 1, max: 100000 },
      {
        path: 'camera.cx', kind: 'number', label: 'Centre cx', unit: 'px', min: -8192, max: 16384,
        help: 'Near the middle of the picture.',
      },
      { path: 'camera.cy', kind: 'number', label: 'Centre cy', unit: 'px', min: -8192, max: 16384 },
    ],
  },
];

export const FINE = {
  name: 'fine',
  title: 'Lens distortion and fine adjustment',
  fields: [
    {
      path: 'camera.distortion', kind: 'numbers', label: 'Distortion', min: -1000, max: 1000, optional: true,
      help: 'Numbers with commas: k1, k2, p1, p2 and more for pinhole, k1 to k4 for fisheye.',
    },
    { path: 'camera.skew', kind: 'number', label: 'Skew', unit: 'px', min: -1000, max: 1000, optional: true },
    {
      path: 'mount.lateral_mm', kind: 'number', label: 'Off the axis', unit: 'mm', min: -5000, max: 5000,
      optional: true, help: 'To the right is positive.',
    },
    {
      path: 'mount.pitch_deg', kind: 'number', label: 'Pitch', unit: '°', min: -80, max: 80, optional: true,
      help: 'Nose up is positive.',
    },
    {
      path: 'mount.roll_deg', kind: 'number', label: 'Roll', unit: '°', min: -80, max: 80, optional: true,
      help: 'Right side down is positive.',
    },
  ],
};

export const ALL_FIELDS = [...GROUPS, FINE].flatMap(({ fields }) => fields);

const DISTORTION_LENGTHS = { pinhole: [0, 4, 5, 8, 12, 14], fisheye: [0, 4] };

/** The value of one field from its text: undefined when it is empty, NaN when it is no number. */
export function parse({ kind }, text) {
  const trimmed = text.trim();
  if (trimmed === '') return undefined;
  if (kind === 'choice') return trimmed;
  if (kind === 'numbers') return trimmed.split(/[\s,;]+/).filter(Boolean).map(Number);
  return Number(trimmed);
}

/** What is wrong with one value, as a sentence, or null. */
export function fault(field, value) {
  if (value === undefined) return field.optional ? null : 'Needed.';
  if (field.kind === 'choice') return null;
  const numbers = [value].flat();
  const unit = field.unit ? ` ${field.unit}` : '';
  if (numbers.some(Number.isNaN)) return 'Not a number. Use a point for decimals.';
  if (field.kind === 'integer' && !Number.isInteger(value)) return 'A whole number is needed.';
  if (numbers.some((number) => number < field.min)) return `At least ${field.min}${unit}.`;
  if (numbers.some((number) => number <= field.above)) return `More than ${field.above}${unit}.`;
  if (numbers.some((number) => number > field.max)) return `At most ${field.max}${unit}.`;
  return null;
}

/** Faults between fields: [path, sentence] pairs. */
export function jointFaults({ camera, mount, pipe }) {
  const faults = [];
  const lengths = DISTORTION_LENGTHS[camera.model] ?? [];
  if (camera.distortion && !lengths.includes(camera.distortion.length)) {
    faults.push([
      'camera.distortion',
      `${camera.distortion.length} numbers; this lens takes ${lengths.slice(1).join(', ')}, or none.`,
    ]);
  }
  if (pipe.shape === 'circular') {
    const radius = pipe.diameter_mm / 2;
    if (Math.hypot(mount.lateral_mm ?? 0, radius - mount.height_mm) >= radius) {
      faults.push(['mount.height_mm', `Outside the pipe: its diameter is ${pipe.diameter_mm} mm.`]);
    }
  }
  return faults;
}
