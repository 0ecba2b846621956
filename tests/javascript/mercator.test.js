/** The projection of the map at the antimeridian, at the poles, and for one place. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import './browser.js';
import {
  fitted, limited, metresPerPx, moved, placeIn, pointAt, scaleBar, toDegrees, toWorld, zoomed,
} from '../../static/core/wall/mercator.js';
import { clustersOf, placesOf } from '../../static/components/assets/map-page/places.js';

const SIZE = { width: 800, height: 600 };
const HERE = [101.69, 3.14];

function at(place, zoom) {
  const [x, y] = toWorld(place);
  return { x, y, zoom };
}

const lines = (...those) => placesOf(those.map((line) => ({ worst_severity: null, line })));

function fit(...those) {
  const places = lines(...those);
  const view = fitted(places.flatMap(({ points }) => points), SIZE, 40);
  return { view, marks: places.map(({ x, y }) => placeIn(view, SIZE, [x, y])) };
}

const near = (found, wanted, tolerance = 1e-6) =>
  found.forEach((part, i) => assert.ok(Math.abs(part - wanted[i]) <= tolerance, `${found}, not ${wanted}`));

test('places are where servers of tiles have them, and where they were zoomed', () => {
  assert.deepEqual(toWorld([-0.1276, 51.5072]).map((side) => Math.floor(side * 2 ** 10)), [511, 340]);
  near(toDegrees(toWorld(HERE)), HERE);
  const [view, spot] = [at(HERE, 15), [700, 100]];
  near(pointAt(zoomed(view, SIZE, 8, spot), SIZE, spot), pointAt(view, SIZE, spot));
});

test('all places are in view', () => {
  const fiji = [[[179.9, -16.5], [-179.9, -16.5]], [[-179.5, -17]], [[179.5, -16]]];
  for (const those of [[[[12, 90]]], fiji, [[HERE]], [[HERE], [HERE]]]) {
    for (const [x, y] of fit(...those).marks) assert.ok(x >= 39 && x <= 761 && y > -1 && y < 601, `${x}, ${y}`);
  }
  const { view } = fit(...fiji);
  assert.ok(view.zoom > 8); // a degree, and not the way round the world
  near([Math.abs(toDegrees([view.x, view.y])[0])], [180], 0.1);
  assert.deepEqual([fit([HERE]).view.zoom, fit([HERE], [HERE]).view.zoom], [17, 17]);
  // A wide view ends before both: it never shows a place twice.
  fit([[0, 90]], [[0, -90]]).marks.forEach((mark, i) => near(mark, [400, [-100, 700][i]], 1e-3));
});

test('a view ends at the poles and goes round at the antimeridian', () => {
  const beyond = moved(at([179.99, 0], 12), SIZE, [-2000, 0]);
  assert.ok(beyond.x >= 0 && beyond.x < 0.01);
  near([limited({ x: 0.5, y: 0, zoom: -9 }, SIZE).y], [0.375]);
});

test('assets in one place are gathered', () => {
  const clusters = clustersOf(lines([HERE], [HERE], [[-179, 0]]), 21);
  assert.deepEqual(clusters.map(({ places }) => places.length), [2, 1]);
});

test('the scale is that of its latitude, in round numbers', () => {
  near([metresPerPx(at([0, 0], 0))], [156543.03], 16);
  near([metresPerPx(at([0, 60], 10))], [156543.03 / 1024 / 2], 0.008);
  const cases = [[1, 'm', 100, 'm', 100], [9, 'm', 1, 'km', 111], [0.05, 'm', 5, 'm', 100], [1, 'ft', 200, 'ft', 61], [40, 'ft', 2, 'mi', 80]];
  for (const [metres, system, ...bar] of cases) {
    const { value, unit, px } = scaleBar(metres, 140, system);
    assert.deepEqual([value, unit, Math.round(px)], bar);
  }
});
