/** Maps distances of one run to those of another run of the same culvert. */

/**
 * @typedef {object} Mark
 * @property {number} number of a joint, from the zero of its run
 * @property {number} mm
 *
 * @typedef {object} Alignment
 * @property {(mm: number) => number} toA a distance of run B, as one of run A
 * @property {(mm: number) => number} toB
 * @property {{number: number, a: number, b: number}[]} joints in common, in mm of their own runs
 */

/**
 * @param {object} options
 * @param {boolean} options.isReversed whether B came from the other end
 * @param {number} options.lengthMm of the culvert, for a reversed run
 * @param {Mark[]} options.jointsA
 * @param {Mark[]} options.jointsB
 * @param {boolean} options.byJoints
 * @returns {Alignment}
 */
export function align({ isReversed, lengthMm, jointsA, jointsB, byJoints }) {
  const turn = (mm) => (isReversed ? lengthMm - mm : mm);
  const turned = jointsB.map(({ number, mm }) => ({ number, mm: turn(mm), own: mm }));
  const joints = rising(common(jointsA, isReversed ? countedFromA(jointsA, turned) : turned));
  const shared = joints.map(({ number, a, own }) => ({ number, a, b: own }));
  if (!byJoints || joints.length === 0) return { toA: turn, toB: turn, joints: shared };
  const [a, b] = [joints.map((joint) => joint.a), joints.map((joint) => joint.b)];
  return {
    toA: (mm) => along(b, a, turn(mm)),
    toB: (mm) => turn(along(a, b, mm)),
    joints: shared,
  };
}

const common = (a, b) =>
  a.flatMap(({ number, mm }) => {
    const other = b.find((joint) => joint.number === number);
    return other ? [{ number, a: mm, b: other.mm, own: other.own }] : [];
  });

/** Joints in an order that both runs share: a wrong count must not fold the culvert. */
function rising(joints) {
  const sorted = joints.toSorted((one, other) => one.a - other.a);
  return sorted.filter(({ a, b }, i) => i === 0 || (a > sorted[i - 1].a && b > sorted[i - 1].b));
}

/**
 * Seen from the other end, joint 1 is the last one: the numbers of a joint in both runs have a constant
 * sum. Most joints that lie near each other agree on it.
 */
function countedFromA(jointsA, turned) {
  const sums = turned.flatMap(({ number, mm }) => {
    const near = jointsA.toSorted((one, other) => Math.abs(one.mm - mm) - Math.abs(other.mm - mm))[0];
    return near ? [near.number + number] : [];
  });
  const votes = [...Map.groupBy(sums, (sum) => sum)].sort(([, one], [, other]) => other.length - one.length);
  if (votes.length === 0) return [];
  return turned.map((joint) => ({ ...joint, number: votes[0][0] - joint.number }));
}

/** Piecewise linear from the places `from` to the places `to`; beyond them shifted by a constant. */
function along(from, to, mm) {
  if (mm <= from[0]) return to[0] + mm - from[0];
  const next = from.findIndex((place) => place > mm);
  if (next < 0) return to.at(-1) + mm - from.at(-1);
  const share = (mm - from[next - 1]) / (from[next] - from[next - 1]);
  return to[next - 1] + share * (to[next] - to[next - 1]);
}
