/** Numbers and words as people read them. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import './browser.js';
import { preferences } from '../../static/core/page/preferences.js';
import { errorText, t, wordFor } from '../../static/core/page/words.js';

/** The results of a function, by its only argument. */
const each = (convert, wanted) =>
  assert.deepEqual(new Map(wanted.map(([value]) => [value, convert(value)])), new Map(wanted));

test('numbers read as people write them, and the other way round', async () => {
  const units = await import('../../static/core/wall/units.js');
  each(units.chainage, [
    [3.4244, '3.42 m'], [3.4249, '3.43 m'], [0.705, '0.71 m'], [3.815, '3.82 m'], [3.8149, '3.82 m'], [1.005, '1.01 m'],
    [-0.005, '−0.01 m'], [-0.0004, '0.00 m'], [-1.5, '−1.50 m'], [null, '– m'],
  ]);
  each(units.plusMinus, [[0.0004, '± 0.01 m'], [0.0101, '± 0.02 m'], [0.02, '± 0.02 m'], [null, '']]);
  each(units.parseDistance, [
    ['12.40', 12.4], [' 12,40 m ', 12.4], ['−0.5', -0.5], ['.5', 0.5], ['10 ft', 3.048], ['', null], ['12.4.1', null],
    ['12 km', null], ['1e3', null],
  ]);
  each(units.timecode, [[63.456, '1:03.46'], [59.999, '1:00.00']]);
  each(units.bytes, [[0, '0 B'], [12345678, '12.3 MB']]);
  each(units.clockHour, [[0.2, '12 o’clock'], [5.6, '6 o’clock']]);
  assert.deepEqual(
    [units.speed(4.25), units.timecode(3723, 0), units.duration(3900)],
    ['4.3 m/min', '1:02:03', '1 h 5 min'],
  );
});

test('distances are shown and typed in feet where that is chosen', async () => {
  preferences.keep({ units: 'ft' });
  const feet = await import('../../static/core/wall/units.js?in=feet'); // the unit is that of when the page is loaded
  preferences.keep({ units: 'm' });
  each(feet.chainage, [[3.048, '10.0 ft'], [-0.01, '0.0 ft'], [0.381, '1.3 ft'], [null, '– ft']]);
  each(feet.plusMinus, [[0.0004, '± 0.1 ft'], [0.3048, '± 1.0 ft'], [0.3049, '± 1.1 ft']]);
  each(feet.parseDistance, [['10', 3.048], ['3 m', 3]]);
  assert.equal(feet.speed(9.144), '30.0 ft/min');
  assert.ok(Math.abs(feet.parseDistance('40,7 FT') - 12.40536) < 1e-9);
});

test('words count and are put together', () => {
  assert.deepEqual([t('progress.frames', { n: 1 }), t('progress.frames', { n: 7 })], ['1 frame', '7 frames']);
  assert.throws(() => t('progress.nothing'), /No words for progress.nothing/);
  assert.throws(() => t('progress.speed'), /progress.speed needs {fps}/);
  assert.deepEqual([wordFor('status', 'done'), wordFor('status', 'other')], ['Done', null]);
});

test('an error is said in the words of the page, unless the server says more', () => {
  const said = 'as the server says';
  assert.notEqual(errorText({ code: 'busy', message: said }), said);
  assert.equal(errorText({ code: 'invalid_rig', message: said }), said);
  assert.equal(errorText({ code: 'a_new_one', detail: said }), said);
});
