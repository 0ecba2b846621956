/** Speeds of the film, in times that of the recording; slow motion to look closely. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

/** Returns the speed next to another, or that one at the end. */
export function besideSpeed(speed, direction) {
  const next = SPEEDS.indexOf(speed) + direction;
  return SPEEDS[Math.min(Math.max(next, 0), SPEEDS.length - 1)];
}
