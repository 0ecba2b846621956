/** What is read from the server: late answers, long lists, messages, and a server that is busy. */

import assert from 'node:assert/strict';
import { afterEach, test } from 'node:test';
import { line } from './browser.js';
import { stateZero, tagged } from './desks.js';
import { undoOf } from '../../static/core/survey/archive.js';
import { ApiError } from '../../static/core/server/api.js';
import { followChanges } from '../../static/core/server/changes-elsewhere.js';
import { parseMessage } from '../../static/core/server/live.js';
import { PagedList } from '../../static/core/page/paged-list.js';
import { faultsIn } from '../../static/core/survey/rules.js';
import { Selection } from '../../static/core/defects/selection.js';
import { Track } from '../../static/core/survey/track.js';

afterEach(() => {
  line.meet = null;
});

/** A track that has been read, and answers with all of its rows that are let through in any order. */
async function trackOnSlowLine() {
  line.meet = null;
  await tagged();
  const track = new Track(process.env.CHAINAGE_INSPECTION);
  await track.extend();
  const held = [];
  line.meet = async (path, pass) => {
    const answer = await pass();
    if (path.endsWith('&since=0')) await new Promise((letThrough) => held.push(letThrough));
    return answer;
  };
  const correct = async (zeroM) => {
    await stateZero(zeroM);
    const reading = track.reload();
    const { length } = held;
    while (held.length === length) await new Promise((resolve) => setTimeout(resolve, 5));
    return { reading, letThrough: held.at(-1) };
  };
  return { track, correct };
}

test('of two corrections the older one is shown only until the newer one comes', async () => {
  for (const isOlderFirst of [true, false]) {
    const { track, correct } = await trackOnSlowLine();
    const both = [await correct(1), await correct(2)];
    const [first, last] = isOlderFirst ? both : both.toReversed();
    first.letThrough();
    await first.reading;
    const zeroMm = () => track.row(2).distance_mm;
    assert.equal(Math.round(zeroMm()), isOlderFirst ? 1000 : 2000);
    last.letThrough();
    await last.reading;
    assert.equal(Math.round(zeroMm()), 2000);
  }
});

test('a track that was cleared does not come back', async () => {
  const { track, correct } = await trackOnSlowLine();
  const { reading, letThrough } = await correct(1);
  track.clear();
  letThrough();
  await reading;
  assert.equal(track.length, 0);
});

test('rows that came after the request for all are read again', async () => {
  const track = new Track(process.env.CHAINAGE_INSPECTION);
  await track.extend();
  const { length } = track;
  line.meet = async (path, pass) => {
    const answer = await pass();
    if (!path.endsWith('&since=0')) return answer;
    const bytes = await answer.arrayBuffer(); // as if there had been five rows when the server was asked
    const begin = new Uint8Array(bytes).indexOf(10) + 1;
    const head = JSON.parse(new TextDecoder().decode(bytes.slice(0, begin)));
    const early = JSON.stringify({ ...head, total: 5, rows: 5 }).padEnd(begin - 1);
    return new Response(`${early}\n${'\0'.repeat(bytes.byteLength)}`);
  };
  await track.reload();
  assert.equal(track.length, length);
});

const list = () =>
  new PagedList('/api/things', { filters: ['search'], limit: 50, signal: new AbortController().signal });

const offsetIn = (path) => Number(new URL(path, location.origin).searchParams.get('offset'));

test('a long list shows the answer to its newest question', async () => {
  const first = Promise.withResolvers();
  line.meet = (path) =>
    offsetIn(path) === 0 ? first.promise : Promise.resolve(Response.json({ total: 100, page: 'second' }));
  const things = list();
  const asked = things.again();
  const turned = things.turnTo(50);
  first.resolve(Response.json({ total: 100, page: 'first' }));
  await turned;
  assert.equal(things.value.page, 'second');
  assert.equal(await asked, false); // overtaken, and no fault
});

test('a long list that has become shorter shows its last page', async () => {
  const offsets = [];
  line.meet = async (path) => {
    offsets.push(offsetIn(path));
    return Response.json({ total: 60, offset: offsets.at(-1) });
  };
  const things = list();
  await things.turnTo(200);
  assert.deepEqual([things.value.offset, offsets, location.search], [50, [200, 50], '?page=2']);
});

test('of all selected rows one is left out and a deleted one is not counted', () => {
  const page = ['a', 'b', 'c'].map((id) => ({ id }));
  const selection = new Selection();
  const sizes = [];
  selection.addEventListener('change', () => sizes.push(selection.size));
  selection.markAll('', 120);
  selection.forget(['c'], 119);
  selection.markOne(page, 'b', { isSelected: false, isRange: false });
  selection.forget(['a'], 118);
  assert.deepEqual([sizes[0], sizes[1], selection.meant.ids], [120, 119, ['c']]);
});

test('an archive names what is undone and what is not', () => {
  const cases = [
    ['start', ['ready', 'done'], true], ['pause', ['waiting', 'running'], true], ['cancel', ['waiting'], true],
    ['cancel', ['waiting', 'running'], false], ['retry', ['refused'], false], ['start', ['done'], false],
  ];
  for (const [what, states, isUndone] of cases) {
    const films = states.map((state, i) => ({ id: String(i), state }));
    assert.equal(undoOf(what, films) !== null, isUndone, `${what} ${states}`);
  }
});

test('a fault of the rules is found at its field', () => {
  const found = faultsIn(
    "rules.1.pattern: the brace { has no partner (found '{a; b'); rules.2: two of a name; " +
      'rigs.Crawler: camera.fx: must be above 0',
  );
  assert.deepEqual(found.map(({ place }) => place), [['rules', '1', 'pattern'], ['rules', '2'], ['rigs', 'Crawler']]);
  assert.equal(found[0].text, "the brace { has no partner (found '{a; b')");
});

test('a live message is split into header and picture', () => {
  const header = new TextEncoder().encode('{"seq":7,"state":"läuft"}');
  const message = (jpeg) => {
    const bytes = new Uint8Array(4 + header.length + jpeg.length);
    new DataView(bytes.buffer).setUint32(0, header.length);
    bytes.set(header, 4);
    bytes.set(jpeg, 4 + header.length);
    return bytes.buffer;
  };
  const full = parseMessage(message([255, 216, 1]));
  assert.deepEqual([full.header, [...full.jpeg]], [{ seq: 7, state: 'läuft' }, [255, 216, 1]]);
  assert.equal(parseMessage(message([])).jpeg, null);
});

test('what a busy server could not answer is read again after a pause', async (t) => {
  t.mock.timers.enable({ apis: ['setTimeout'] });
  const refusals = [503, 404];
  const asked = [];
  let read;
  const next = () => new Promise((resolve) => (read = resolve));
  const live = Object.assign(new EventTarget(), { state: 'OPEN' });
  const fault = new Promise((resolve) => {
    followChanges(live, async () => {
      const status = refusals.shift();
      asked.push(status);
      read();
      throw new ApiError(status, 'busy', '');
    }, resolve, new AbortController().signal);
  });
  live.dispatchEvent(new Event('changed'));
  const first = next();
  t.mock.timers.tick(300);
  await first;
  await new Promise(setImmediate);
  t.mock.timers.tick(2999);
  assert.deepEqual(asked, [503]);
  t.mock.timers.tick(1);
  assert.equal((await fault).status, 404);
});
