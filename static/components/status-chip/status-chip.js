/** The state of an inspection in a word and a sign. */

import { html } from '../../core/html.js';
import { icon } from '../icon/icon.js';

const STATES = {
  queued: ['wait', 'Queued'],
  running: ['live', 'Tracking'],
  done: ['check', 'Done'],
  failed: ['alert', 'Failed'],
  cancelled: ['stop', 'Cancelled'],
};

export function statusChip(status) {
  const [sign, word] = STATES[status];
  return html`<span class="chip chip--${status}">${icon(sign)}${word}</span>`;
}
