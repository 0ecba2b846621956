/**
 * Matches the defects of two runs, and says what became of each from A to B. The history of an asset has the
 * same rules (`app/survey/assets/asset_history.py`); here the runs may also come from both ends.
 * Where the server has their walls in register, it says itself what became of each.
 */

import { ROUNDING_MM, isWithin } from '../../../core/wall/spans.js';
import { isDefect } from '../../../core/defects/stretches.js';

/** Distance between two people's clicks on the same defect. */
const SPOT_MM = 100;
/** Clock positions in whole hours may differ by one. */
const HOURS = 1;
/** Half-width assumed for a distance without an interval, as another program measured it. */
const UNSTATED_U95_MM = 300;

/** What became of a defect; `uncovered`: only one of the runs was there. */
export const KINDS = ['new', 'grown', 'gone', 'unchanged', 'uncovered'];

/**
 * @typedef {object} Pair
 * @property {'new'|'grown'|'gone'|'unchanged'|'uncovered'} kind
 * @property {object|null} a observation of run A
 * @property {object|null} b
 * @property {number} mm where it is, in run A
 *
 * @typedef {object} Seen
 * @property {object[]} observations
 * @property {number|null} endMm distance that the run reached; null if nobody has looked for defects yet
 */

/**
 * @param {Seen} a the earlier run
 * @param {Seen} b
 * @param {import('./alignment.js').Alignment} alignment
 * @param {boolean} isReversed
 * @returns {Pair[]} along the culvert
 */
export function match(a, b, alignment, isReversed) {
  const placed = (items, toA) =>
    items
      .filter((item) => item.code !== null && isDefect(item) && item.distance_m !== null)
      .map((item) => ({ item, mm: toA(1000 * item.distance_m) }));
  const here = placed(a.observations, (mm) => mm);
  const there = placed(b.observations, alignment.toA);
  const candidates = here
    .flatMap((one) => there.map((other) => ({ one, other, apart: Math.abs(one.mm - other.mm) })))
    .filter(
      ({ one, other, apart }) =>
        apart <= reach(one.item, other.item) + ROUNDING_MM && isSame(one.item, other.item, isReversed),
    )
    .sort((first, second) => first.apart - second.apart);
  const taken = new Set();
  /** @type {Pair[]} */
  const pairs = [];
  for (const { one, other } of candidates) {
    if (taken.has(one) || taken.has(other)) continue;
    taken.add(one).add(other);
    const kind = growth(one.item, other.item) ? 'grown' : 'unchanged';
    pairs.push({ kind, a: one.item, b: other.item, mm: one.mm });
  }
  for (const { item, mm } of here.filter((one) => !taken.has(one))) {
    pairs.push({ kind: covers(b, item, alignment.toB(mm)) ? 'gone' : 'uncovered', a: item, b: null, mm });
  }
  for (const { item, mm } of there.filter((one) => !taken.has(one))) {
    pairs.push({ kind: covers(a, item, mm) ? 'new' : 'uncovered', a: null, b: item, mm });
  }
  return pairs.sort((one, other) => one.mm - other.mm);
}

/**
 * Returns what the server says became of each defect; what it says nothing about, the other run has not seen.
 * @param {Seen} a
 * @param {Seen} b
 * @param {Api['ComparedDefectOut'][]} matched
 * @param {import('./alignment.js').Alignment} alignment
 * @returns {Pair[]} along the culvert
 */
export function pairsOf(a, b, matched, alignment) {
  const placed = ({ observations }) =>
    observations.filter((item) => item.code !== null && isDefect(item) && item.distance_m !== null);
  const left = [a, b].map((run) => new Map(placed(run).map((item) => [item.id, item])));
  const take = (side, id) => {
    const item = left[side].get(id) ?? null;
    left[side].delete(id);
    return item;
  };
  const found = matched.map(({ observation, earlier_observation: earlier, change }) => ({
    kind: /** @type {Pair['kind']} */ (change === 'first' ? 'uncovered' : change),
    a: take(0, earlier),
    b: take(1, observation),
  }));
  const others = left.flatMap((items, side) =>
    [...items.values()].map((item) => ({
      kind: /** @type {Pair['kind']} */ ('uncovered'),
      a: side ? null : item,
      b: side ? item : null,
    })),
  );
  return [...found, ...others]
    .filter((pair) => pair.a || pair.b)
    .map((pair) => ({ ...pair, mm: pair.a ? 1000 * pair.a.distance_m : alignment.toA(1000 * pair.b.distance_m) }))
    .sort((one, other) => one.mm - other.mm);
}

/** Whether a run would have shown a defect of the other one, which lies at `mm` in it. */
const covers = ({ endMm }, item, mm) => endMm !== null && isWithin(mm + u95Mm(item), { low: 0, high: endMm });

/** Returns what has grown from A to B: {name, from, to}, or null. */
export function growth(a, b) {
  for (const name of ['severity', 'quant1', 'quant2']) {
    const [from, to] = [a[name] ?? null, b[name] ?? null];
    if (from !== null && to !== null && to > from) return { name, from, to };
  }
  return null;
}

/** Reach of a match: both intervals, and the tolerance of a click. */
const reach = (a, b) => SPOT_MM + Math.hypot(u95Mm(a), u95Mm(b));

const u95Mm = ({ distance_u95_m: u95 }) => (u95 === null ? UNSTATED_U95_MM : 1000 * u95);

function isSame(a, b, isReversed) {
  if (a.code !== b.code || roleOf(a) !== roleOf(b, isReversed)) return false;
  const [one, other] = [sectorOf(a), mirrored(sectorOf(b), isReversed)];
  return one === null || other === null || hoursApart(one, other) <= HOURS;
}

/** Returns the role in a stretch; seen from the other end a start is a finish. */
function roleOf({ continuous }, isReversed = false) {
  const role = continuous?.[0] ?? null;
  return isReversed ? ({ A: 'B', B: 'A' }[role] ?? role) : role;
}

/**
 * Returns hours from and to, clockwise, 1 and 12 for all round; null where none is given.
 * @returns {[number, number]|null}
 */
export function sectorOf({ clock_from: from, clock_to: to, clock }) {
  const first = from ?? clock ?? null;
  if (first === 12 && to === 12) return [1, 12];
  return first === null ? null : [first, to ?? first];
}

/**
 * Mirrors a sector: seen from the other end, 3 o'clock is 9 o'clock.
 * @param {[number, number]|null} sector
 * @param {boolean} isReversed
 * @returns {[number, number]|null}
 */
export const mirrored = (sector, isReversed) => (sector && isReversed ? [12 - sector[1], 12 - sector[0]] : sector);

/** Whether a sector has all hours, also when it is mirrored. */
export const isAllRound = ([from, to]) => turn(to - from) === 11;

/** Returns the hours between two sectors, 0 where they overlap. */
function hoursApart([from, to], [start, end]) {
  const within = (hour, first, last) => turn(hour - first) <= turn(last - first);
  if (within(start, from, to) || within(from, start, end)) return 0;
  return Math.min(turn(start - to), turn(from - end));
}

const turn = (hours) => ((hours % 12) + 12) % 12;
