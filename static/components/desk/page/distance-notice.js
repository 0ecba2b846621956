/**
 * What the distances need: the unit of the film's counter; else a repair of what makes them useless, or typed ones; else
 * what picture and rig disagree about.
 */

import { refusalIn } from '../../../core/server/api.js';
import { html, renderNew } from '../../../core/page/html.js';
import { causeText, repairOf } from '../../../core/survey/diagnosis.js';
import { mayEdit } from '../../../core/page/rights.js';
import { BY_CAMERA, SOURCES } from '../../../core/survey/track.js';
import { t, wordFor } from '../../../core/page/words.js';
import { Component } from '../../../core/page/store.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

export class DistanceNotice extends Component {
  mount() {
    this.page = this.closest('inspection-page');
    this.desk = this.page.desk;
    this.classList.add('message', 'message--warning');
    this.setAttribute('role', 'status');
    this.tabIndex = 0; // shown in full with the focus, or under the pointer
    const { corrections, counter, diagnosis, inspection, track } = this.desk;
    this.listen([corrections, counter, diagnosis, track], 'change', () => this.#show());
    this.listen(inspection, 'change', () => this.#load());
    this.listen(this, 'click', ({ target }) => this.#clicked(target.closest('button')?.dataset ?? {}));
    this.#load();
    this.#show();
  }

  async #load() {
    try {
      await this.desk.diagnosis.load(this.signal);
    } catch (error) {
      if (!refusalIn(error)) return; // without it the page is as it was
    }
  }

  #show() {
    const notice = this.#notice();
    this.hidden = notice === null;
    if (!notice) return;
    const { text, buttons } = notice;
    renderNew(this, html`${icon('alert')}<span>${text}</span>${mayEdit() && html`<div class="flow">${buttons}</div>`}`);
  }

  /** The most urgent one, or null. */
  #notice() {
    const { corrections, diagnosis } = this.desk;
    const [cause] = diagnosis.value?.causes ?? [];
    const [notice] = corrections.value?.result?.notices ?? [];
    return (
      (cause && this.#ofUseless(cause)) ??
      (notice && { text: wordFor('notice', notice.code, notice.params), buttons: repair(repairOf(notice)) }) ??
      null
    );
  }

  /** What helps where the camera failed, and nothing carries the distances in its place. */
  #ofUseless(cause) {
    const { counter, diagnosis, inspection, track } = this.desk;
    const isByCamera = track.column('source').every((source) => BY_CAMERA.has(SOURCES[source]));
    if (!isByCamera && inspection.value.is_useful !== false) return undefined;
    const { state, legible, unit } = counter.value ?? {};
    const mayCarry = isByCamera && track.length > 0 && state !== 'waiting';
    if (mayCarry && legible > 0 && unit === null)
      return { text: t('notice.counter_unit'), buttons: ['m', 'ft'].map((name) => button('unit', name, name)) };
    const typed = mayCarry && button('type', '', t('typed.begin'));
    return { text: seen(diagnosis.value) + causeText(cause), buttons: [repair(cause.repair), typed] };
  }

  #clicked({ unit, type, repair: what }) {
    const { counter, tab } = this.desk;
    if (unit) orToast(() => counter.state({ ...counter.stated, unit }));
    if (what) this.page.trackAgain(what);
    if (type === undefined) return;
    tab.set('corrections');
    this.page.querySelector('typed-section').begin();
  }
}

const button = (does, what, text) =>
  html`<button type="button" class="button button--small" data-${does}="${what}">${text}</button>`;

const repair = (what) => what && what !== 'film' && button('repair', what, wordFor('repair_button', what));

/** 'Lost in 68 % of the film. ' @param {Api['DiagnosisOut']} diagnosis */
function seen({ lost_share: lost }) {
  const percent = Math.round(100 * (lost ?? 0));
  return percent ? `${t('cause.lost_in', { percent })} ` : '';
}

customElements.define('distance-notice', DistanceNotice);
