/** The state of a live inspection's camera, and the end of the recording; removed when it has ended. */

import { ownKey } from '../../../core/page/keys.js';
import { get, poll } from '../../../core/server/api.js';
import { html, render, setText } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { bytes, timecode } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const TICK_MS = 500;
const COUNTER_POLL_S = 3;
const LITTLE_ROOM_BYTES = 2e9;

export class LiveBar extends Component {
  /** When camera and server were last reachable, by `performance.now`. */
  #cameraMs = performance.now();
  #serverMs = performance.now();
  #wasConnected = false;

  mount() {
    this.page = this.closest('inspection-page');
    this.desk = this.page.desk;
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', t('live.label'));
    /** @type {Parts<'video/live-bar'>} */
    this.parts = render(
      this,
      html`<p class="live__state row shrinks strong" data-part="state"><span data-part="sign"></span><span class="number two-lines" data-part="text"></span></p>
        <p class="live__fact small dim nowrap number" data-part="recorded"></p>
        <p class="live__fact small dim nowrap number" title="${t('live.skipped_help')}" data-part="skipped"></p>
        <p class="live__fact small dim nowrap number" data-part="room"></p>
        <p class="live__fact small dim nowrap live__fact--counter small-sign" data-part="counter" hidden><span data-part="counterSign"></span><span role="status" data-part="counterText"></span></p>
        <span class="spacer grow"></span>
        <button class="button" data-part="zero" data-needs="operator"><kbd>${ownKey('Z')}</kbd>${t('corrections.zero_here')}</button>
        <button class="button button--primary" data-part="finish" data-needs="operator">${icon('flag')}${t('finish.open')}</button>
        <p class="visually-hidden" role="status" data-part="announced"></p>`,
    );
    this.listen(this.parts.zero, 'click', () => this.page.setZero());
    this.listen(this.parts.finish, 'click', () => this.page.finish());
    // After a click the keyboard focus returns to the film.
    this.listen(this, 'mousedown', (event) => event.target.closest('button') && event.preventDefault());
    this.listen(this.desk.inspection, 'change', () => this.#cameraReported());
    this.listen(this.desk.live, 'state', () => this.#show());
    // A hidden page does not expect messages.
    this.listen(document, 'visibilitychange', () => (this.#serverMs = performance.now()));
    const timer = setInterval(() => this.#show(), TICK_MS);
    this.signal.addEventListener('abort', () => clearInterval(timer));
    this.#cameraReported();
    // An unreachable server is reported elsewhere.
    poll(
      () => this.#askCounter(),
      this.signal,
      () => {},
    );
  }

  /** Requests the state of the connection to the software that uses Chainage as its meter counter. */
  async #askCounter() {
    if (this.hidden) return COUNTER_POLL_S;
    const { peer, is_connected: isConnected, detail } = await get('/api/meter-counter', this.signal);
    if (peer === null) return null;
    const { counter, counterSign, counterText } = this.parts;
    counter.hidden = false;
    counter.title = peer;
    counter.classList.toggle('live__fact--warning', !isConnected);
    render(counterSign, icon(isConnected ? 'check' : 'alert'));
    setText(
      counterText,
      isConnected ? t('live.counter') : t('live.no_counter', { reason: detail ?? t('live.counter_waits') }),
    );
    return COUNTER_POLL_S;
  }

  /** Handles the server's report on the camera. */
  #cameraReported() {
    const { live } = this.desk.inspection.value;
    this.hidden = live === null;
    if (live?.connected) {
      this.#cameraMs = performance.now();
      this.#wasConnected = true;
    }
    this.#show();
  }

  #show() {
    if (this.hidden) return;
    const { parts, desk } = this;
    const { live } = desk.inspection.value;
    const now = performance.now();
    if (desk.live.state === 'OPEN' || document.hidden) this.#serverMs = now;
    const seconds = (since) => ({ s: Math.round((now - since) / 1000) });
    parts.finish.hidden = parts.zero.hidden = live.is_ending;
    if (desk.live.state !== 'OPEN' && now - this.#serverMs > TICK_MS) {
      this.#state('no-server', t('live.no_server', seconds(this.#serverMs)));
    } else if (live.is_ending) this.#state('ending', t('live.ending'));
    else if (!live.is_recording) this.#state('full', t('live.full'));
    else if (live.connected && live.shed.length) this.#state(`slow ${live.shed.length}`, slowText(live));
    else if (live.connected) this.#state('connected', t('live.connected'));
    else if (this.#wasConnected || live.recorded_s > 0) {
      const text = t('live.reconnecting', seconds(this.#cameraMs));
      this.#state('reconnecting', [text, live.detail].filter(Boolean).join(' '));
    } else this.#state('connecting', [t('live.connecting'), live.detail].filter(Boolean).join(' '));
    setText(parts.recorded, t('live.recorded', { time: timecode(live.recorded_s, 0) }));
    setText(parts.skipped, live.dropped ? t('live.skipped', { n: live.dropped }) : '');
    setText(parts.room, t('live.room', { room: bytes(live.free_bytes) }));
    parts.room.classList.toggle('live__fact--warning', live.free_bytes < LITTLE_ROOM_BYTES);
  }

  /** Announces another state once, not at every second of it. */
  #state(name, text) {
    setText(this.parts.text, text);
    if (this.dataset.state === name) return;
    this.dataset.state = name;
    render(this.parts.sign, icon({ connected: 'live', connecting: 'wait', ending: 'wait' }[name] ?? 'alert'));
    this.parts.announced.textContent = text;
  }
}

/** What a machine that is too slow leaves out. @param {Api['LiveOut']} live */
function slowText({ skipped_share: share, shed }) {
  const what = shed.map((part) => wordFor('live_shed', part)).join(', ');
  return `${t('live.connected')} · ${t('live.slow', { percent: Math.round(100 * share), what })}`;
}

customElements.define('live-bar', LiveBar);
