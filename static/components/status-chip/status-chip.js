/** The state of an inspection as a word and a sign. */

import { html } from '../../core/html.js';
import { wordFor } from '../../core/words.js';
import { icon } from '../icon/icon.js';

const SIGNS = { queued: 'wait', running: 'live', done: 'check', failed: 'alert', cancelled: 'stop' };

export const STATES = Object.keys(SIGNS);

export const statusChip = (status) =>
  html`<span class="chip chip--${status}">${icon(SIGNS[status])}${wordFor('status', status)}</span>`;
