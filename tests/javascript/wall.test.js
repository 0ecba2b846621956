/** The wall under a pixel, what is measured on it, and runs that are compared: as the server has them. */

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { line } from './browser.js';
import { PATH, tagged } from './desks.js';
import { measured, quantityOf } from '../../static/core/wall/measure.js';
import { lacking } from '../../static/core/survey/register.js';
import { WallGrid } from '../../static/core/wall/wall.js';
import { WallMap } from '../../static/core/wall/wall-map.js';
import { byWalls } from '../../static/components/desk/compare/alignment.js';
import { match } from '../../static/components/desk/compare/matching.js';
import { arcAt, cutAtCrown } from '../../static/components/film/views/rows.js';

/** What the server's own modules answer, from `test_page_modules.py`. */
const truth = JSON.parse(readFileSync(process.env.CHAINAGE_TRUTH));
/** The table is interpolated for a read-out in whole centimetres. */
const TOLERANCE_M = 0.002;

function near(found, wanted, tolerance, what) {
  assert.ok(Math.abs(found - wanted) <= tolerance, `${what}: ${found}, not ${wanted}`);
}

test('the wall under the cursor is the one that the server states', async () => {
  await tagged();
  const wall = new WallGrid(await line.ask('GET', `${PATH}/wallgrid`));
  const { columns } = await line.ask('GET', `${PATH}/track?format=json`);
  const { width, height } = (await line.ask('GET', PATH)).video;
  for (const frame of [0, columns.frame.length - 1]) {
    const pose = Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, values[frame]]));
    for (const [u, v] of [[1, 1], [width / 2, height / 2], [width - 2, 20], [37.5, height - 2]]) {
      const exact = await line.ask('GET', `${PATH}/wall?u=${u}&v=${v}&frame=${frame}`);
      const point = wall.at(u, v, pose);
      near(point.distance_m, exact.distance_m, TOLERANCE_M, `distance at ${u}, ${v}`);
      if (exact.clock !== null) near(point.clock_h, exact.clock, 0.1, `clock at ${u}, ${v}`);
      wall.pixel(point, pose).forEach((part, i) => near(part, [u, v][i], 1, `pixel ${u}, ${v}`));
    }
  }
});

test('a camera that looks aside has the wall under the cursor', () => {
  for (const { grid, pose, seen } of truth.looking) {
    const wall = new WallGrid(grid);
    for (const { pixel, distance_mm: exact, clock_h: clock, right_mm: right } of seen) {
      const point = wall.at(...pixel, pose);
      // Interpolated in cells of 20 px, a farther wall less exactly.
      near(1000 * point.distance_m, exact, 0.01 * (exact - pose.x_mm) + 0.3, `distance at ${pixel}`);
      near(point.clock_h, clock, 0.02, `clock at ${pixel}`);
      near(point.right_mm, right, 1.6, `right at ${pixel}`); // 0.02 h of 150 mm
      wall.pixel(point, pose).forEach((part, i) => near(part, pixel[i], 1, `pixel ${pixel}`));
    }
  }
});

test('the outline of the view crosses the unrolled wall nowhere', () => {
  for (const { grid, pose } of truth.outlined) {
    const points = new WallGrid(grid).outline(pose).map(({ distance_m, clock_h }) => ({
      mm: Math.min(1000 * distance_m, pose.x_mm + 600),
      arc: arcAt(clock_h, grid.radius_mm),
    }));
    const lines = cutAtCrown(points, grid.radius_mm);
    // Ahead it goes round the pipe once, and is cut at the crown; aside it is one loop.
    assert.equal(lines.length, pose.yaw_deg === 0 ? 2 : 1);
    for (const points of lines) {
      const apart = (name) => points.slice(1).map((point, i) => Math.abs(point[name] - points[i][name]));
      assert.ok(Math.max(...apart('arc')) < 100);
      assert.ok(Math.max(...apart('mm')) < 250);
      assert.ok(points.every(({ mm }) => mm > pose.x_mm - 30));
    }
  }
});

test('the page measures what the server does', () => {
  const { grid, pose, clicks, figures } = truth.measured;
  const wall = new WallGrid(grid);
  const sights = clicks.map((click) => wall.sight(...click, pose));
  for (const { kind, count, value, percent } of figures) {
    const found = measured(kind, sights.slice(0, count), wall.radius);
    near(found.value, value, Math.max(0.01 * value, 0.5), kind);
    if (percent === null) assert.equal(found.percent, null, kind);
    else near(found.percent, percent, 0.01 * percent, kind);
  }
});

test('a size becomes the quantity of a code in its unit', () => {
  const depth = { value: 41.2, percent: 13.7 };
  const other = { value: -18.04, percent: null };
  const cases = [
    ['depth', depth, '%', 150, 14], ['depth', depth, 'mm', 150, 41], ['step', other, '%', 150, 6],
    ['gap', other, 'mm', null, 18], ['width', { value: 2.34, percent: null }, 'mm', 150, 2.3],
    ['area', other, 'mm', 150, null], ['length', other, 'deg', 150, null], ['step', other, '%', null, null],
  ];
  for (const [kind, figure, unit, radius, quantity] of cases) {
    assert.equal(quantityOf(kind, figure, unit, radius), quantity, `${kind} in ${unit}`);
  }
});

test('a header is filled from the register as the server does', () => {
  for (const { header, completed } of truth.register.headers) {
    assert.deepEqual({ ...header, ...lacking(truth.register.fields, header) }, completed);
  }
});

test('walls in register take the stretching out of a run, and say where they are not', () => {
  const gaps = [{ from_m: 2.2, to_m: 3, reason: 'unlike' }];
  const laters = [[0, 0], [0, 1.02], [0, 2.04], [1, 3.06], [1, 4.08]];
  // From the other end what comes later lies before.
  for (const [direction, earlierOf] of [['same', (m) => m / 1.02], ['opposite', (m) => 5 - m / 1.02]]) {
    const map = laters.map(([stretch, m]) => ({
      distance_m: m, earlier_distance_m: earlierOf(m), arc_mm: 0, sigma_mm: 1, stretch,
    }));
    const walls = new WallMap({ direction, map, gaps });
    const { toA, toB } = byWalls(walls);
    for (const mm of [510, 1020, 2500, 3900]) {
      near(toA(mm), 1000 * earlierOf(mm / 1000), 1e-6, `${mm} in A`);
      near(toB(toA(mm)), mm, 1e-6, `${mm} and back`);
    }
    const ends = [0, 4.08].map((m) => 1000 * earlierOf(m)).sort((one, other) => one - other);
    const [gap, ...others] = walls.gapsWithin(...ends);
    assert.deepEqual([others, gap.reason], [[], 'unlike']);
    // The stretches go on to the gap by the scale of neither run.
    near(gap.to - gap.from, 800 / 1.02, 10, 'length of the gap');
  }
});

test('two runs are compared by the rules of the history of an asset', () => {
  const asTheyAre = { toA: (mm) => mm, toB: (mm) => mm };
  const pairs = match(...truth.compared.runs, asTheyAre, false);
  const found = pairs.map(({ kind, a, b }) => [a?.id ?? null, b?.id ?? null, kind]);
  assert.deepEqual(found.map(String).sort(), truth.compared.pairs.map(String).sort());
  assert.equal(new Set(pairs.map(({ kind }) => kind)).size, 5);
});
