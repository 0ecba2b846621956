/** Two people change the same thing: nobody loses anything, and who was second decides. */

import assert from 'node:assert/strict';
import { afterEach, test } from 'node:test';
import { line } from './browser.js';
import { change, erase, opened, PATH, question, settled, stateZero, stored, tagged, UNSTATED, until } from './desks.js';
import { Operations } from '../../static/core/server/operations.js';
import { Corrections, withKnownLength } from '../../static/core/survey/corrections.js';

afterEach(() => {
  line.meet = null;
});

/** The stored answer to the next request for the list of defects is held until it is let through. */
function holdList() {
  const held = Promise.withResolvers();
  const asked = Promise.withResolvers();
  line.meet = async (path, pass, method) => {
    if (method !== 'GET' || !path.endsWith('/observations')) return pass();
    asked.resolve();
    const answer = await pass();
    await held.promise;
    return answer;
  };
  return { isAsked: asked.promise, letThrough: held.resolve };
}

test('mine is kept: it replaces theirs', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  await change(id, { severity: 4, remark: 'roots' });
  desk.observations.edit(id, { severity: 3 });
  const { mine, theirs, about, keepMine } = await question(desk);
  assert.deepEqual([about, mine.severity, theirs.severity, theirs.remark], [id, 3, 4, 'roots']);
  assert.deepEqual(await stored(), [['BAB', 4, 'roots']]);
  await keepMine();
  await settled(desk);
  assert.deepEqual(await stored(), [['BAB', 3, null]]);
});

test('theirs is taken: what follows is made of it, also before the list is read', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  await change(id, { severity: 4, remark: 'roots' });
  desk.observations.edit(id, { severity: 3 });
  const { takeTheirs } = await question(desk);
  const { isAsked, letThrough } = holdList();
  const taken = takeTheirs();
  await isAsked;
  desk.observations.edit(id, { severity: 5 });
  letThrough();
  await taken;
  await settled(desk);
  assert.deepEqual(await stored(), [['BAB', 5, 'roots']]);
});

test('what was deleted comes back only when it is wanted', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  for (const [answer, severity, left] of [['keepMine', 3, [['BAB', 3, null]]], ['takeTheirs', 4, []]]) {
    await erase(id);
    desk.observations.edit(id, { severity });
    const asked = await question(desk);
    assert.equal(asked.theirs, null);
    assert.deepEqual(await stored(), []);
    await asked[answer]();
    await settled(desk);
    assert.equal(desk.observations.value.length, left.length);
    assert.deepEqual(await stored(), left);
  }
});

for (const [answer, left] of [['takeTheirs', 1], ['keepMine', 0]]) {
  test(`what somebody else has changed is deleted only when it is wanted: ${answer}`, async (t) => {
    const [id] = await tagged();
    const desk = await opened(t);
    await change(id, { severity: 5, remark: 'roots' });
    desk.observations.remove(id);
    const asked = await question(desk);
    assert.deepEqual([asked.mine, asked.theirs.severity], [null, 5]);
    await until(() => desk.observations.find(id)?.remark === 'roots');
    const { save, isDeleted } = desk.observations.find(id);
    assert.deepEqual([save, isDeleted], ['refused', true]); // in the list again, until it is decided
    assert.equal((await stored()).length, 1);
    await asked[answer]();
    await settled(desk);
    assert.equal((await stored()).length, left);
    if (left === 0) await desk.history.undo(); // what was deleted as they had changed it comes back so
    await settled(desk);
    assert.deepEqual(await stored(), [['BAB', 5, 'roots']]);
  });
}

test('a list that was read before a deletion does not bring it back', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  const { isAsked, letThrough } = holdList();
  const reading = desk.observations.load();
  await isAsked;
  desk.observations.remove(id);
  await settled(desk);
  letThrough();
  await reading;
  assert.deepEqual(desk.observations.value, []);
});

test('a deletion is decided in any tab', async (t) => {
  const [id] = await tagged();
  const operations = new Operations(null);
  const tabs = [await opened(t, operations), await opened(t, operations)];
  await change(id, { severity: 5 });
  tabs[0].observations.remove(id);
  for (const tab of tabs) assert.equal((await question(tab)).mine, null);
  await tabs[1].conflicts.value[0].keepMine();
  for (const tab of tabs) await settled(tab);
  for (const tab of tabs) await until(() => tab.observations.value.length === 0);
  assert.deepEqual(await stored(), []);
});

test('a deletion that is decided before its tab has read the list is shown at once', async (t) => {
  const [id] = await tagged();
  const operations = new Operations(null);
  const [here, there] = [await opened(t, operations), await opened(t, operations)];
  await change(id, { severity: 5 });
  const { letThrough } = holdList();
  here.observations.remove(id);
  await (await question(there)).keepMine();
  await settled(there);
  assert.deepEqual(there.observations.value, []);
  letThrough();
  assert.deepEqual(await stored(), []);
});

test('a refused deletion that is undone is no question any more, nor is the change before it', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  line.cut();
  desk.observations.edit(id, { severity: 3 });
  desk.observations.remove(id);
  await change(id, { severity: 5 });
  line.mend();
  assert.equal((await question(desk)).mine, null);
  await desk.history.undo();
  await until(() => desk.conflicts.value[0]?.mine?.severity === 3); // still a question, until it is undone too
  await desk.history.undo();
  await settled(desk);
  assert.deepEqual(desk.observations.find(id).severity, 5);
  assert.deepEqual(await stored(), [['BAB', 5, null]]);
});

test('a deletion that was undone offline changes nothing', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  line.cut();
  desk.observations.remove(id);
  await desk.history.undo();
  await change(id, { severity: 5 });
  line.mend();
  await settled(desk);
  await until(() => desk.observations.find(id).severity === 5);
  assert.deepEqual(await stored(), [['BAB', 5, null]]);
});

test('own changes and their deletion are no question, nor is what is already gone', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  line.cut();
  desk.observations.edit(id, { severity: 3 });
  desk.observations.edit(id, { remark: 'wet' });
  desk.observations.remove(id);
  line.mend();
  await settled(desk);
  assert.deepEqual(await stored(), []);
  await desk.history.undo();
  await settled(desk);
  assert.deepEqual(await stored(), [['BAB', 3, 'wet']]);
  await erase(id);
  desk.observations.remove(id);
  await settled(desk);
  assert.deepEqual(desk.observations.value, []);
});

test('own changes follow each other: letters, grades and undo, while each is sent or was not answered yet', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  desk.observations.edit(id, { severity: 3 });
  for (const [visit, words] of [[{}, ['w', 'wet']], [{}, ['wet a', 'wet and']], [{}, ['wet and cracked']]]) {
    for (const remark of words) desk.observations.type(id, { remark }, visit);
    desk.observations.edit(id, { severity: words.length % 5 });
  }
  await settled(desk);
  assert.deepEqual(await stored(), [['BAB', 1, 'wet and cracked']]);
  while (desk.history.last) await desk.history.undo();
  await settled(desk);
  assert.deepEqual(await stored(), [['BAB', 2, null]]);
});

test('a change whose answer was lost is no conflict, not even for another tab', async (t) => {
  const [id] = await tagged();
  const operations = new Operations(null);
  const desk = await opened(t, operations);
  line.meet = async (path, pass, method) => {
    if (method === 'GET') return pass();
    await pass();
    throw new TypeError('The line is cut.');
  };
  desk.observations.edit(id, { severity: 3 });
  await until(() => desk.outbox.reason);
  desk.observations.edit(id, { remark: 'made of what has arrived' });
  desk.observations.edit(id, { severity: 5 });
  assert.deepEqual(await stored(), [['BAB', 3, null]]);
  line.meet = null;
  const other = await opened(t, operations);
  await settled(other);
  await settled(desk);
  assert.deepEqual(await stored(), [['BAB', 5, 'made of what has arrived']]);
});

test('a page that was offline finds a newer version, also after a reload', async (t) => {
  const [id] = await tagged();
  const operations = new Operations(null);
  const desk = await opened(t, operations);
  line.cut();
  desk.observations.edit(id, { severity: 3 });
  desk.observations.type(id, { remark: 'offline' }, {});
  await change(id, { severity: 4 });
  line.mend();
  await question(desk);
  const again = await opened(t, operations);
  const { mine, theirs, keepMine } = await question(again);
  assert.deepEqual([mine.severity, mine.remark, theirs.severity], [3, 'offline', 4]);
  assert.deepEqual(await stored(), [['BAB', 4, null]]);
  await keepMine();
  await settled(again);
  assert.deepEqual(await stored(), [['BAB', 3, 'offline']]);
});

test('a refused change that is undone is no question any more', async (t) => {
  const [id] = await tagged();
  const desk = await opened(t);
  await change(id, { severity: 4 });
  desk.observations.edit(id, { severity: 3 });
  await question(desk);
  await desk.history.undo();
  await settled(desk);
  await until(() => desk.observations.find(id).severity === 4);
  assert.deepEqual(await stored(), [['BAB', 4, null]]);
});

test('a change of what is no longer stored is asked about', async (t) => {
  const cases = [['remark', 'crack', 'roots', 'cracks'], ['quant1', 3, 35, 4], ['code', 'BAB', 'BAC', 'BAF']];
  for (const [name, seen, theirs, typed] of cases) {
    const [id] = await tagged();
    await change(id, { [name]: seen });
    const desk = await opened(t);
    await change(id, { [name]: theirs, severity: 4 });
    await desk.observations.load();
    const edit = name === 'remark' ? 'type' : 'edit';
    desk.observations[edit](id, { [name]: typed }, ...(edit === 'type' ? [{}] : []), { [name]: seen });
    const asked = await question(desk);
    assert.deepEqual([asked.mine[name], asked.theirs[name], asked.mine.severity], [typed, theirs, 4]);
    await asked.takeTheirs();
    await settled(desk);
    assert.equal(desk.observations.find(id)[name], theirs);
  }
});

test('several questions stay in the order in which they came', async (t) => {
  const [first, second] = await tagged(2);
  const desk = await opened(t);
  line.cut();
  desk.observations.edit(first, { severity: 3 });
  desk.observations.edit(second, { severity: 5 });
  await change(first, { severity: 4 });
  await change(second, { code: 'BAF' });
  line.mend();
  await until(() => desk.conflicts.value.length === 2);
  assert.deepEqual(desk.conflicts.value.map(({ about }) => about), [first, second]);
  await desk.conflicts.value[0].keepMine();
  await until(() => desk.conflicts.value.length === 1);
  await desk.conflicts.value[0].takeTheirs();
  await settled(desk);
  assert.deepEqual(await stored(), [['BAB', 3, null], ['BAF', 2, null]]);
});

const zero = (offset_m) => ({ zero: { frame: 2, offset_m } });
const storedZero = async () => (await line.ask('GET', `${PATH}/corrections`)).stated.zero.offset_m;

for (const [answer, offset_m] of [['keepMine', 0.75], ['takeTheirs', 0.25]]) {
  test(`corrections that were overtaken wait as a draft, also after a reload: ${answer}`, async (t) => {
    await tagged();
    await stateZero(0);
    const desk = await opened(t);
    desk.corrections.edit(zero(0.5));
    const { draftOf } = desk.corrections;
    await stateZero(0.25);
    await desk.corrections.load(); // learns of it, and keeps what its draft was made of
    assert.equal(desk.corrections.draftOf, draftOf);
    assert.equal(await desk.correct(desk.corrections.draft.value, 'by hand', draftOf), false);
    assert.deepEqual([(await question(desk)).mine.zero, await storedZero()], [zero(0.5).zero, 0.25]);
    desk.corrections.edit(zero(0.75)); // it may be edited until it is decided

    const again = await opened(t);
    const asked = await question(again);
    assert.deepEqual([asked.mine.zero.offset_m, asked.theirs.zero.offset_m], [0.75, 0.25]);
    await asked[answer]();
    await settled(again);
    assert.equal(await storedZero(), offset_m);
    assert.equal(again.corrections.isEdited, false);
    const { events } = await line.ask('GET', `${PATH}/events`);
    assert.equal(events[0].remark === 'by hand', answer === 'keepMine');
    assert.doesNotMatch(JSON.stringify(localStorage), /unsent/);
  });
}

test('a correction is undone', async (t) => {
  await tagged();
  await stateZero(0.25);
  const desk = await opened(t);
  await desk.correct({ ...desk.corrections.value.stated, ...zero(1) }, null);
  assert.equal(await storedZero(), 1);
  await desk.history.undo();
  assert.equal(await storedZero(), 0.25);
});

test('what is stated before the page has read what is stored is added to it', async (t) => {
  await tagged();
  const joints = { use: null, marked: [], left_out: [{ frame: 5 }] };
  await line.ask('PUT', `${PATH}/corrections`, { ...UNSTATED, joints, zero: { frame: 2, offset_m: 0.1 } });
  const end = new AbortController();
  t.after(() => end.abort());
  const corrections = new Corrections(process.env.CHAINAGE_INSPECTION, end.signal);
  const reading = corrections.load();
  const known = { first_frame: 2, last_frame: 9, length_m: 0.8, sigma_mm: 5 };
  corrections.edit({ zero: { frame: 3, offset_m: 0.2 } });
  corrections.edit(withKnownLength(corrections.draft.value, known));
  await reading;
  assert.deepEqual(corrections.draft.value, {
    ...corrections.value.stated, joints, zero: { frame: 3, offset_m: 0.2 }, lengths: [{ ...known, kind: 'known' }],
  });
  assert.deepEqual([corrections.value.stated.zero.frame, corrections.isEdited], [2, true]);
});
