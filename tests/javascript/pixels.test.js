/** Films whose pixels are not square. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import './browser.js';
import { focalDown, focalOfAngle } from '../../static/core/wall/lens.js';
import { squareOf, toSquare } from '../../static/core/wall/pixels.js';
import { changesFor } from '../../static/components/intake/rig-wizard/guess.js';

const PAL = { width: 720, height: 576, pixel_aspect: 16 / 15 };

test('a picture with square pixels loses none', () => {
  assert.deepEqual(squareOf(PAL), { width: 768, height: 576 });
  assert.deepEqual(squareOf({ width: 720, height: 480, pixel_aspect: 8 / 9 }), { width: 720, height: 540 });
  assert.deepEqual(squareOf({ width: 640, height: 480 }), { width: 640, height: 480 });
});

test('the corners of the film are those of the picture', () => {
  const near = (found, expected) => found.forEach((at, i) => assert.ok(Math.abs(at - expected[i]) < 1e-9));
  near(toSquare(PAL, [-0.5, -0.5]), [-0.5, -0.5]);
  near(toSquare(PAL, [719.5, 575.5]), [767.5, 575.5]);
});

test('fy is proposed from the pixels', () => {
  assert.equal(focalDown(675, PAL.pixel_aspect), 720);
  const { changes } = changesFor({ camera: {}, mount: {}, pipe: {} }, PAL);
  assert.equal(changes['camera.fy'], focalDown(changes['camera.fx'], PAL.pixel_aspect));
  const diagonal = focalOfAngle(60, 'diagonal', PAL);
  assert.ok(Math.abs(diagonal - 480 / (16 / 15) / Math.tan(Math.PI / 6)) < 0.01, 'half of 768 x 576 is 480 across');
});
