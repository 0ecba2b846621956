/** What a code asks about a defect, and what keys answer. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import './browser.js';
import { Catalogue } from '../../static/core/defects/codes.js';
import { answerOf, nextOpen, questionsOf } from '../../static/core/defects/questions.js';

const row = (code, char1, char2, label, needs = {}) => ({
  code, char1, char2, label, labels: {}, letters: `${code}${char1}${char2}`, words: '', isOffered: true,
  group: 'S', needs_clock: 'no', needs_q1: 'no', needs_q2: 'no', ...needs,
});
const CATALOGUE = new Catalogue([
  row('BAB', 'A', 'A', 'Crack: hairline, along', { needs_clock: 'yes', needs_q1: 'opt' }),
  row('BAB', 'B', 'A', 'Crack: line, along', { needs_clock: 'yes', needs_q1: 'yes' }),
  row('BAB', 'B', 'B', 'Crack: line, around', { needs_clock: 'yes', needs_q1: 'yes' }),
  row('AED', 'ST', '', 'Material: steel', { group: 'C' }),
  row('AED', 'STZ', '', 'Material: clay', { group: 'C' }),
  row('AED', 'PE', '', 'Material: plastic', { group: 'C' }),
]);
const asked = (item) => questionsOf(item, CATALOGUE).filter(({ isOpen }) => isOpen).map(({ name }) => name);
const named = (item, wanted) => questionsOf(item, CATALOGUE).find(({ name }) => name === wanted);

/** What the keys of a text answer, typed one after the other. */
function typed(question, keys) {
  let answer = { typed: '', changes: null, isDone: false };
  for (const key of keys) answer = answerOf(question, answer.typed, key) ?? { ...answer, isRefused: true };
  return answer;
}

test('a code asks for what a report lacks and for the severity of a defect, and only for that', () => {
  assert.deepEqual(asked({ code: null }), []);
  assert.deepEqual(asked({ code: 'BAB' }), ['char1', 'clock', 'severity']);
  assert.deepEqual(asked({ code: 'BAB', char1: 'B', clock: 6 }), ['char2', 'quant1', 'severity']);
  const crack = { code: 'BAB', char1: 'B', char2: 'A', clock: 6, quant1: 2 };
  assert.deepEqual(asked(crack), ['severity']);
  assert.deepEqual(asked({ ...crack, severity: 3 }), []);
  // A hairline may have its width; nobody has to state it.
  assert.deepEqual(asked({ code: 'BAB', char1: 'A', char2: 'A', clock: 6, severity: 1 }), []);
  assert.ok(named({ code: 'BAB', char1: 'A', char2: 'A' }, 'quant1'));
  // The finish of a stretch repeats its start; a material is no defect.
  assert.deepEqual(asked({ code: 'BAB', char1: 'B', char2: 'A', continuous: 'B1' }), []);
  assert.deepEqual(asked({ code: 'AED', char1: 'PE' }), []);
});

test('a question that was passed over does not come again', () => {
  const questions = questionsOf({ code: 'BAB' }, CATALOGUE);
  assert.equal(nextOpen(questions).name, 'char1');
  assert.equal(nextOpen(questions, new Set(['char1', 'clock'])).name, 'severity');
  assert.equal(nextOpen(questions, new Set(['char1', 'clock', 'severity'])), null);
});

test('a character is answered as soon as no other begins like that', () => {
  const kind = named({ code: 'BAB' }, 'char1');
  assert.deepEqual(typed(kind, 'b'), { typed: 'B', changes: { char1: 'B', char2: null }, isDone: true });
  assert.equal(answerOf(kind, '', 'x'), null);
  assert.equal(answerOf(kind, '', 'ArrowRight'), null);
  const material = named({ code: 'AED' }, 'char1');
  assert.equal(typed(material, 's').changes, null);
  assert.deepEqual(typed(material, 'st'), { typed: 'ST', changes: { char1: 'ST', char2: null }, isDone: false });
  assert.equal(typed(material, 'stz').changes.char1, 'STZ');
  assert.equal(typed(material, 'p').changes.char1, 'PE');
});

test('a number is taken sign by sign, an hour once it can be no other', () => {
  const [width, clock, severity] = ['quant1', 'clock', 'severity'].map((name) =>
    named({ code: 'BAB', char1: 'B', char2: 'A' }, name),
  );
  assert.deepEqual(typed(width, '0,4'), { typed: '0,4', changes: { quant1: 0.4 }, isDone: false });
  assert.ok(typed(width, '1..').isRefused);
  assert.equal(answerOf(width, '', 'b'), null);
  const hours = (keys) => Object.values(typed(clock, keys).changes ?? {});
  assert.deepEqual([hours('3'), typed(clock, '3').isDone], [[3, null], true]);
  assert.deepEqual([hours('1'), typed(clock, '1').isDone], [[1, null], false]);
  assert.deepEqual([hours('@11@2'), typed(clock, '@11@2').isDone], [[11, 2], true]);
  assert.ok(typed(clock, '13').isRefused);
  assert.deepEqual(typed(severity, '5'), { typed: '', changes: { severity: 5 }, isDone: true });
  assert.equal(answerOf(severity, '', '6'), null);
});
