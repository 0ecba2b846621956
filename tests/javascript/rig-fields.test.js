/** What the form of a rig says of a value that cannot be. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import './browser.js';
import { ALL_FIELDS, fault, jointFaults, parse } from '../../static/components/intake/rig-form/fields.js';

test('a value that is none, out of bounds or of the wrong kind has a sentence', () => {
  const cases = [
    ['pipe.diameter_mm', '20', 'At least 50 mm.'],
    ['pipe.diameter_mm', 'three hundred', 'Not a number. Use a point for decimals.'],
    ['mount.height_mm', '100000', 'At most 10000 mm.'],
    ['mount.height_mm', '0', 'More than 0 mm.'],
    ['camera.width', '640.5', 'A whole number is needed.'],
    ['mount.rotation_deg', '', 'Needed.'],
    ['camera.distortion', '', null],
    ['camera.distortion', '0.1, -0.2; 0 0', null],
  ];
  for (const [path, text, sentence] of cases) {
    const field = ALL_FIELDS.find((each) => each.path === path);
    assert.equal(fault(field, parse(field, text)), sentence, path);
  }
});

test('values that do not go together are said of the field that is likelier wrong', () => {
  const camera = { model: 'pinhole', width: 640, height: 480, fx: 600, fy: 600 };
  const [mount, pipe] = [{ height_mm: 150 }, { shape: 'circular', diameter_mm: 300 }];
  const faults = (changes) => new Map(jointFaults({ camera, mount, pipe, ...changes }));
  assert.equal(faults({}).size, 0);
  assert.match(faults({ camera: { ...camera, fx: 8 } }).get('camera.fx'), /Is it the lens’s focal length in mm\?/);
  assert.match(
    faults({ camera: { ...camera, distortion: [0.1, 0.2] } }).get('camera.distortion'),
    /2 numbers; this lens takes 4, 5, 8, 12, 14, or none\./,
  );
  const half = { ...pipe, corrugation: { pitch_mm: 67.7 } };
  assert.equal(faults({ pipe: half }).get('pipe.corrugation.depth_mm'), 'Needed.');
  assert.match(faults({ mount: { height_mm: 310 } }).get('mount.height_mm'), /outside the pipe/);
});
