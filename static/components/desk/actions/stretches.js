/** Starting, changing and finishing continuous defects. */

import { openStretches, partsOf, stretchNumber } from '../../../core/defects/stretches.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { orToast, toast } from '../../shared/toast-stack/toast-stack.js';

/** A selected tag starts the stretch if the robot has moved at most this far since, in m. */
export const HERE_M = 0.25;
/** Distances are shown to a centimetre: anything shorter is a point. */
const POINT_M = 0.01;
/** Points of the same code that are farther apart may be the ends of a stretch. */
const OFFERED_FROM_M = 1;

/**
 * Starts a new stretch at the robot: at the selected tag, if it was made here and belongs to no stretch,
 * else at a new one. A tag selected elsewhere is offered as an alternative.
 * @param {Desk} desk
 */
export function startStretch(desk) {
  const { observations, selection, history } = desk;
  const item = selection.value ? observations.find(selection.value) : null;
  const isFree = item !== null && !item.continuous;
  if (isFree && desk.isNear(item.frame, HERE_M)) {
    startStretchAt(desk, item);
    return;
  }
  const number = observations.nextStretch;
  const start = desk.tagCentre({ continuous: `A${number}` });
  if (!start) return;
  const step = history.last;
  const instead = async () => {
    await history.undo(step);
    if (observations.find(item.id)) startStretchAt(desk, item);
  };
  desk.done(
    startedText(number, start),
    isFree
      ? {
          action: t('stretch.instead', { where: chainage(item.distance_m) }),
          run: () => orToast(instead),
        }
      : {},
  );
}

/** Makes any tag the start of a new stretch. */
export function startStretchAt(desk, item) {
  const number = desk.observations.nextStretch;
  desk.observations.edit(item.id, { continuous: `A${number}` });
  desk.select(item.id);
  desk.done(startedText(number, item));
}

const startedText = (number, { distance_m: m }) => t('stretch.started', { stretch: `A${number}`, where: chainage(m) });

/**
 * Tags the end of an open stretch, by default the newest, at the shown frame.
 * @param {Desk} desk
 * @param {number|string|null} [number]
 */
export function finishStretch(desk, number = newest(desk)) {
  const finish = number && goOn(desk, number, 'B');
  if (!finish) return;
  const [start] = partsOf(desk.observations.value, finish);
  if (Math.abs(finish.distance_m - start.distance_m) >= POINT_M) return;
  toast(t('stretch.no_length', { stretch: number }), {
    kind: 'error',
    action: t('stretch.as_point'),
    run: () => {
      desk.observations.makePoint(number);
      desk.selection.set(start.id);
    },
  });
}

/** Tags a change of an open stretch. */
export function changeStretch(desk, number = newest(desk)) {
  if (number) goOn(desk, number, 'C');
}

/** Dissolves the selected stretch: its tags become points. */
export function dissolveStretch(desk, item) {
  const parts = partsOf(desk.observations.value, item);
  desk.observations.editTogether(parts.map(({ id }) => [id, { continuous: null }]));
}

/** Returns the nearest point before this one that may be the other end of a stretch, or null. */
export function otherEnd(desk, item) {
  const { code, char1, char2, distance_m: end } = item;
  const rules = code && desk.catalogue.row(code, char1, char2);
  if (!rules?.continuous_allowed || item.continuous || end === null) return null;
  const isLike = (other) =>
    !other.continuous &&
    ['code', 'char1', 'char2'].every((name) => (other[name] ?? null) === (item[name] ?? null)) &&
    end - other.distance_m > OFFERED_FROM_M;
  return desk.observations.value.findLast((other) => other.distance_m !== null && isLike(other)) ?? null;
}

/** Makes a stretch of two points, in one step. */
export function joinPoints(desk, start, finish) {
  const number = desk.observations.nextStretch;
  desk.observations.editTogether([
    [start.id, { continuous: `A${number}` }],
    [finish.id, { continuous: `B${number}` }],
  ]);
}

/** Makes the finish of a stretch its start, and the start its finish, in one step. */
export function swapEnds(desk, number) {
  const parts = partsOf(desk.observations.value, { continuous: `A${number}` });
  const [start, finish] = ['A', 'B'].map((role) => parts.find((part) => part.continuous === `${role}${number}`));
  desk.observations.editTogether([
    [start.id, { continuous: finish.continuous }],
    [finish.id, { continuous: start.continuous }],
  ]);
  desk.done(t('checks.swapped', { stretch: number }));
}

function newest(desk) {
  const [stretch] = openStretches(desk.observations.value);
  if (!stretch) desk.fault(t('stretch.none_open'));
  return stretch ? stretchNumber(stretch.start) : null;
}

/** @param {Desk} desk @param {number|string} number @param {'B'|'C'} role */
function goOn(desk, number, role) {
  const [{ code, char1, char2 }] = partsOf(desk.observations.value, { continuous: `A${number}` });
  return desk.tagCentre({ code, char1, char2, continuous: `${role}${number}` });
}
