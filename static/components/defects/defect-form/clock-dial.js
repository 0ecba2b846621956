/**
 * Clock positions on a ring: place on the wall, seen in the direction of travel; 12 is the crown. A touch
 * sets one position, dragging along the ring a sector; each end is a slider for the keyboard.
 */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const RADIUS = 68;
/** Radius at which the second end waits while there is only one position. */
const OUTSIDE = 91;
const HOURS = Array.from({ length: 12 }, (_, i) => i + 1);
const STEPS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 };

/** Returns the hour that is `steps` hours clockwise of `hour`. */
const turned = (hour, steps) => ((hour - 1 + steps + 24) % 12) + 1;

/** Returns the hours from one to another, clockwise; 0 from an hour to itself. */
const between = (from, to) => (to - from + 12) % 12;

const pointAt = (hour, radius) => {
  const angle = (hour / 12) * 2 * Math.PI;
  return [radius * Math.sin(angle), -radius * Math.cos(angle)].map((value) => Number(value.toFixed(2)));
};

/** Returns the path of the ring from one hour to another; all of it from 12 to 12. */
function arc(from, to) {
  const [[x1, y1], [x2, y2]] = [pointAt(from, RADIUS), pointAt(to, RADIUS)];
  if (from === to) return `M${x1} ${y1}A${RADIUS} ${RADIUS} 0 1 1 ${x1 - 0.01} ${y1}`;
  return `M${x1} ${y1}A${RADIUS} ${RADIUS} 0 ${between(from, to) > 6 ? 1 : 0} 1 ${x2} ${y2}`;
}

/** Fires `pick` (detail {from, to, isDrawn}) when a person has chosen other hours, by pointer or by key. */
export class ClockDial extends Component {
  #value = { from: null, to: null };
  #measured = null;
  /** The current drag: where it began, how far it went. */
  #drag = null;

  mount() {
    this.setAttribute('role', 'group');
    this.setAttribute('aria-label', t('dial.label'));
    /** @type {Parts<'defect-form/clock-dial'>} */
    this.parts = render(
      this,
      html`<svg class="dial" viewBox="-99 -99 198 198" data-part="face">
          <circle class="dial__ring" r="${RADIUS}" />
          <path class="dial__sector" data-part="sector" />
          <g aria-hidden="true">${HOURS.map((hour) => {
            const [x, y] = pointAt(hour, RADIUS);
            return html`<text class="dial__hour" x="${x}" y="${y}">${hour}</text>`;
          })}</g>
          <path class="dial__measured" d="M0-44l-5 9h10z" data-part="measured" />
          ${end('to', t('form.clock_to'))}${end('from', t('form.clock_from'))}
          <text class="dial__hours-text" y="0" data-part="hoursText" aria-hidden="true"></text>
          <text class="dial__note" y="20" data-part="note" aria-hidden="true"></text>
        </svg>
        <div class="dial__buttons flow">
          <button type="button" class="button button--small" data-part="round">${t('dial.all_round')}</button>
          <button type="button" class="button button--small" data-part="clear">${icon('undo')}${t('dial.clear')}</button>
        </div>`,
    );
    const { parts } = this;
    this.listen(parts.face, 'pointerdown', (event) => this.#grasp(event));
    this.listen(parts.face, 'pointermove', (event) => this.#draw(event));
    this.listen(parts.face, 'pointerup', () => this.#letGo(true));
    this.listen(parts.face, 'pointercancel', () => this.#letGo(false));
    this.listen(parts.from, 'keydown', (event) => this.#key(event, 'from'));
    this.listen(parts.to, 'keydown', (event) => this.#key(event, 'to'));
    this.listen(parts.round, 'click', () => this.#pick(12, 12));
    this.listen(parts.clear, 'click', () => this.#pick(null, null));
    this.#show();
  }

  /**
   * @param {{from: number|null, to: number|null}} value the entered value
   * @param {number|null} measured the hour of the wall point
   */
  set(value, measured) {
    this.#value = value;
    this.#measured = measured;
    if (!this.#drag) this.#show();
  }

  #key(event, name) {
    const { from, to } = this.#value;
    const start = from ?? this.#measured ?? 12;
    const step = STEPS[event.key];
    if (step !== undefined) {
      if (name === 'to') this.#pick(start, turned(to ?? start, step));
      else this.#pick(from === null && this.#measured === null ? 12 : turned(start, step), to);
    } else if (event.key === 'Delete' || event.key === 'Backspace') {
      if (name === 'to') this.#pick(from, null);
      else this.#pick(null, null);
    } else return;
    // Elsewhere the arrows belong to the film, and Delete to the defect.
    event.preventDefault();
    event.stopPropagation();
  }

  #grasp(event) {
    const name = event.target.closest('[data-end]')?.dataset.end;
    const hour = this.#hourAt(event);
    event.preventDefault();
    this.parts.face.setPointerCapture(event.pointerId);
    this.parts[name ?? 'from'].focus({ preventScroll: true });
    this.#drag = { name, at: hour, hour, steps: 0 };
    this.#show();
  }

  #draw(event) {
    if (!this.#drag) return;
    const hour = this.#hourAt(event);
    const moved = between(this.#drag.hour, hour);
    this.#drag.steps += moved > 6 ? moved - 12 : moved;
    this.#drag.hour = hour;
    this.#show();
  }

  #letGo(isMeant) {
    if (!this.#drag) return;
    const { from, to } = this.#shown;
    this.#drag = null;
    if (isMeant) this.#pick(from, to, true);
    this.#show();
  }

  /** The hours including the current drag. A sector drawn in the other direction is the same one. */
  get #shown() {
    const { from, to } = this.#value;
    if (!this.#drag) return { from, to };
    const { name, at, hour, steps } = this.#drag;
    if (name === 'to') return { from: from ?? this.#measured ?? at, to: steps === 0 ? to : hour };
    if (name === 'from') return { from: steps === 0 ? from : hour, to };
    if (Math.abs(steps) >= 12) return { from: 12, to: 12 };
    if (steps === 0) return { from: at, to: null };
    return steps > 0 ? { from: at, to: hour } : { from: hour, to: at };
  }

  #pick(from, to, isDrawn = false) {
    const isPoint = from === null || to === null || (from === to && from !== 12);
    const detail = { from, to: isPoint ? null : to, isDrawn };
    if (detail.from === this.#value.from && detail.to === this.#value.to) return;
    this.#value = detail;
    this.#show();
    this.dispatchEvent(new CustomEvent('pick', { detail }));
  }

  #hourAt({ clientX, clientY }) {
    const box = this.parts.face.getBoundingClientRect();
    const [x, y] = [clientX - box.x - box.width / 2, clientY - box.y - box.height / 2];
    return Math.round((Math.atan2(x, -y) / (2 * Math.PI)) * 12 + 12) % 12 || 12;
  }

  #show() {
    const { parts } = this;
    if (!parts) return; // not in the page yet
    const { from, to } = this.#shown;
    const start = from ?? this.#measured;
    const isSector = from !== null && to !== null;
    parts.sector.setAttribute('d', isSector ? arc(from, to) : '');
    place(parts.from, start ?? 12, RADIUS, from ?? this.#measured ?? '–');
    place(parts.to, to ?? start ?? 12, isSector ? RADIUS : OUTSIDE, isSector ? to : '');
    parts.from.classList.toggle('dial__end--measured', from === null);
    parts.to.classList.toggle('dial__end--waiting', !isSector);
    parts.measured.toggleAttribute('hidden', this.#measured === null);
    parts.measured.setAttribute('transform', `rotate(${(this.#measured ?? 0) * 30})`);
    parts.hoursText.textContent = isSector ? `${from} – ${to}` : (start ?? '–');
    parts.note.textContent = from === null && start !== null ? t('dial.measured') : '';
    const fromText = from === null ? this.#unstated() : t('units.clock', { hour: from });
    name(parts.from, start ?? 12, fromText);
    name(parts.to, to ?? start ?? 12, isSector ? t('units.clock', { hour: to }) : t('form.one_position'));
    parts.clear.disabled = from === null;
    parts.round.disabled = from === 12 && to === 12;
  }

  #unstated() {
    if (this.#measured === null) return t('form.not_given');
    return t('form.measured', { clock: t('units.clock', { hour: this.#measured }) });
  }
}

const end = (part, label) => html`<g class="dial__end dial__end--${part}" role="slider" tabindex="0"
  aria-label="${label}" aria-valuemin="1" aria-valuemax="12" data-end="${part}" data-part="${part}"><circle
  class="dial__reach" r="22" /><circle class="dial__knob" r="15" /><text></text></g>`;

function place(element, hour, radius, text) {
  element.setAttribute('transform', `translate(${pointAt(hour, radius).join(' ')})`);
  element.querySelector('text').textContent = text;
}

function name(element, now, text) {
  element.setAttribute('aria-valuenow', now);
  element.setAttribute('aria-valuetext', text);
}

customElements.define('clock-dial', ClockDial);
