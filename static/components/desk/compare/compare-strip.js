/** Both runs along the culvert, in one lane each, with their defects and one play head. */

import { Plot } from '../../../core/wall/axis.js';
import { html, render } from '../../../core/page/html.js';
import { onThemeChange, sharpContext, typeScale } from '../../../core/page/screen.js';
import { Component } from '../../../core/page/store.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { paintAxis } from '../../distance/strip/paint.js';
import { drawSeverity } from '../../shared/severity-mark/severity-mark.js';

const LEFT = 34;
const LANES = { a: 26, b: 70, axis: 98 };
const BAR = 8;
const MARK_PX = 20;

/** Events: `place` (detail: mm in run A), `pick` (detail: a pair). */
export class CompareStrip extends Component {
  /** {low, high, a, b, pairs, alignment}: set it to draw. */
  #scene = null;
  #place = 0;
  #scale = 1;

  mount() {
    /** @type {Parts<'compare/compare-strip'>} */
    this.parts = render(
      this,
      html`<div class="compare-strip__track" role="slider" tabindex="0" aria-label="${t('compare.strip')}" data-part="track">
        <canvas data-part="canvas" aria-hidden="true"></canvas></div>`,
    );
    const { track } = this.parts;
    this.listen(track, 'pointerdown', (event) => {
      track.setPointerCapture(event.pointerId);
      const pair = this.#pairAt(event);
      if (pair) this.dispatchEvent(new CustomEvent('pick', { detail: pair }));
      else this.#announcePlace(event);
    });
    this.listen(track, 'pointermove', (event) => {
      if (track.hasPointerCapture(event.pointerId)) this.#announcePlace(event);
    });
    onThemeChange(() => this.repaint(), this.signal);
    const resized = new ResizeObserver(() => this.repaint());
    resized.observe(track);
    this.signal.addEventListener('abort', () => resized.disconnect());
  }

  set scene(scene) {
    this.#scene = scene;
    this.repaint();
  }

  set place(mm) {
    this.#place = mm;
    this.repaint();
  }

  get #plot() {
    return new Plot(this.#scene, this.parts.track.clientWidth / this.#scale, LEFT);
  }

  #announcePlace({ offsetX }) {
    const { low, high } = this.#scene;
    const mm = Math.min(Math.max(this.#plot.toMm(offsetX / this.#scale), low), high);
    this.dispatchEvent(new CustomEvent('place', { detail: mm }));
  }

  /** The pair whose mark, in either lane, is under the pointer. */
  #pairAt({ offsetX, offsetY }) {
    const [x, y] = [offsetX / this.#scale, offsetY / this.#scale];
    return this.#scene.pairs.find((pair) =>
      this.#marks(pair).some((mark) => Math.hypot(mark.x - x, mark.y - y) <= MARK_PX / 2),
    );
  }

  #marks({ a, b }) {
    const { alignment } = this.#scene;
    const plot = this.#plot;
    return [
      a && { x: plot.toX(1000 * a.distance_m), y: LANES.a, severity: a.severity },
      b && { x: plot.toX(alignment.toA(1000 * b.distance_m)), y: LANES.b, severity: b.severity },
    ].filter(Boolean);
  }

  paint() {
    if (!this.#scene || this.parts.track.clientWidth === 0) return;
    this.#scale = typeScale();
    const context = sharpContext(this.parts.canvas, this.#scale);
    const styles = getComputedStyle(this);
    const colour = (name) => styles.getPropertyValue(name);
    context.font = `500 12px ${colour('--sans')}`;
    this.#paintLanes(context, colour);
    paintAxis(context, colour, this.#plot, this.#scene, LANES.axis);
    this.#paintPairs(context, colour, styles);
    this.#paintPlace(context, colour);
    this.#describe();
  }

  #paintLanes(context, colour) {
    const { a, b, alignment } = this.#scene;
    const plot = this.#plot;
    const ends = [alignment.toA(b.low), alignment.toA(b.high)];
    context.strokeStyle = colour('--line-strong');
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    for (const [name, y, low, high] of /** @type {const} */ ([
      [t('compare.a'), LANES.a, a.low, a.high],
      [t('compare.b'), LANES.b, Math.min(...ends), Math.max(...ends)],
    ])) {
      const [left, right] = [plot.toX(low), plot.toX(high)];
      context.fillStyle = colour('--raised');
      context.beginPath();
      context.roundRect(left, y - BAR / 2, Math.max(right - left, 2), BAR, 3);
      context.fill();
      context.stroke();
      context.fillStyle = colour('--text');
      context.fillText(name, 10, y);
    }
  }

  #paintPairs(context, colour, styles) {
    for (const pair of this.#scene.pairs) {
      const marks = this.#marks(pair);
      if (marks.length === 2) {
        context.strokeStyle = pair.kind === 'grown' ? colour('--lost') : colour('--line-strong');
        context.lineWidth = pair.kind === 'grown' ? 2.5 : 1.5;
        context.beginPath();
        context.moveTo(marks[0].x, marks[0].y);
        context.lineTo(marks[1].x, marks[1].y);
        context.stroke();
        context.lineWidth = 1;
      }
      for (const { x, y, severity } of marks) drawSeverity(context, severity, x, y, MARK_PX, styles);
    }
  }

  #paintPlace(context, colour) {
    const x = this.#plot.toX(this.#place);
    context.fillStyle = colour('--text');
    context.fillRect(x - 1, 6, 2, LANES.axis - 6);
    context.beginPath();
    context.moveTo(x - 6, LANES.axis + 8);
    context.lineTo(x + 6, LANES.axis + 8);
    context.lineTo(x, LANES.axis);
    context.fill();
  }

  #describe() {
    const { track } = this.parts;
    const { low, high } = this.#scene;
    track.setAttribute('aria-valuemin', String(Math.round(low) / 1000));
    track.setAttribute('aria-valuemax', String(Math.round(high) / 1000));
    track.setAttribute('aria-valuenow', String(Math.round(this.#place) / 1000));
    track.setAttribute('aria-valuetext', chainage(this.#place / 1000));
  }
}

customElements.define('compare-strip', CompareStrip);
