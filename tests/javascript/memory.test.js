/** What a browser remembers, and what of it is used. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import './browser.js';
import { Operations } from '../../static/core/server/operations.js';
import { preferences } from '../../static/core/page/preferences.js';
import { recall, recallMembers, remember } from '../../static/core/page/remembered.js';
import { unfinishedFilms } from '../../static/core/server/upload.js';

test('broken or foreign memories of a browser count as none', () => {
  const cases = [
    ['{broken', {}, {}], ['[1]', {}, {}], ['null', {}, {}], ['{"a": 1}', [], []], ['"text"', null, null],
    ['{"a": 1}', null, { a: 1 }],
  ];
  for (const [text, otherwise, found] of cases) {
    localStorage.setItem('x', text);
    assert.deepEqual(recall('x', otherwise), found, text);
  }
  remember('x', { lanes: 'all', click: 'seek', other: 1, pack: 7 });
  const members = recallMembers('x', { lanes: ['wall'], click: 'tag', pack: null });
  assert.deepEqual(members, { lanes: ['wall'], click: 'seek', pack: 7 });
  remember('x', null);
  assert.equal(localStorage.getItem('x'), null);
});

test('the archive file of an inspection is no unfinished film', () => {
  const url = '/api/uploads/1';
  remember('chainage.upload:1', { url, name: 'north/run.mp4' });
  remember('chainage.upload:2', { url, name: 'CUL-1.chainage.ZIP' });
  assert.deepEqual(unfinishedFilms().map(({ name }) => name), ['north/run.mp4']);
});

test('changes stay in memory where the browser gives no storage', async () => {
  const operations = await Operations.open('none');
  await operations.put({ id: '1' });
  assert.equal(operations.isKept, false);
  assert.deepEqual(await operations.all(), [{ id: '1' }]);
});

test('what a first-time visitor has chosen is what the server says, so the page is not drawn again', async () => {
  assert.equal(await preferences.load(), false);
  assert.equal(preferences.person?.role, 'admin');
});
