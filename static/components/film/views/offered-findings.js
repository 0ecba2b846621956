/** The findings on offer, as outlines on the unrolled wall. */

import { outlineOf } from '../../../core/defects/findings.js';

/** A smaller one is as easy to hit as one of this size. */
const LEAST_PX = 16;
const HALO = 'rgb(8 10 12 / 70%)';
const OFFERED = '#ffb347';
const SHOWN = '#ffffff';

export class OfferedFindings {
  #desk;
  /** Where each is on the strip: {finding, left, right, top, bottom}. */
  #boxes = [];

  /** @param {Desk} desk */
  constructor(desk) {
    this.#desk = desk;
  }

  paint(context, plot, rows, radius) {
    const { findings, axis } = this.#desk;
    const { low, high } = axis.value;
    this.#boxes = [];
    for (const finding of findings.queue) {
      if (1000 * finding.to_m < low || 1000 * finding.from_m > high) continue;
      const isShown = finding.id === findings.current.value;
      for (const line of insideOf(outlineOf(finding), radius)) {
        const points = line.map(([mm, arc]) => [plot.toX(mm), rows.toY(arc)]);
        this.#boxes.push({ finding, ...boxOf(points) });
        context.beginPath();
        for (const [x, y] of points) context.lineTo(x, y);
        if (finding.kind !== 'crack') context.closePath();
        for (const [width, colour] of [
          [isShown ? 5 : 3.5, HALO],
          [isShown ? 3 : 1.5, isShown ? SHOWN : OFFERED],
        ]) {
          context.lineWidth = width;
          context.strokeStyle = colour;
          context.stroke();
        }
      }
    }
    context.lineWidth = 1;
  }

  /** Returns the smallest finding at a place of the strip, or null. */
  at(x, y) {
    const near = this.#boxes.filter((box) => x >= box.left && x <= box.right && y >= box.top && y <= box.bottom);
    const size = ({ left, right, top, bottom }) => (right - left) * (bottom - top);
    return near.toSorted((a, b) => size(a) - size(b))[0]?.finding ?? null;
  }
}

/** What crosses the crown goes on beyond it: such an outline is drawn at both edges of the strip. */
function insideOf(outline, radius) {
  if (radius === null) return [outline];
  const turn = 2 * Math.PI * radius;
  const arcs = outline.map(([, arc]) => arc);
  const shifts = [0];
  if (Math.max(...arcs) > turn / 2) shifts.push(-turn);
  if (Math.min(...arcs) < -turn / 2) shifts.push(turn);
  return shifts.map((shift) => outline.map(([mm, arc]) => [mm, arc + shift]));
}

function boxOf(points) {
  const side = (i) => {
    const all = points.map((point) => point[i]);
    const [least, most] = [Math.min(...all), Math.max(...all)];
    const wanting = Math.max(0, LEAST_PX - (most - least)) / 2;
    return [least - wanting, most + wanting];
  };
  const [[left, right], [top, bottom]] = [side(0), side(1)];
  return { left, right, top, bottom };
}
