/** The defects that must not wait: where they are, the act-now sheet, and who was notified. */

import { Alerts, reasonText } from '../../../core/server/alerts.js';
import { exportPath } from '../../../core/survey/exports.js';
import { html, render, renderNew } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { date } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { GRAVEST, severityMark } from '../../shared/severity-mark/severity-mark.js';
import { icon } from '../../shared/icon/icon.js';

/** Number of defects named here; the list has all of them. */
const NAMED = 3;

export class EmergencyBanner extends Component {
  #alerts;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    const { id } = this.desk.inspection;
    this.#alerts = new Alerts(id, this.signal);
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', t('emergency.title'));
    /** @type {Parts<'frame/emergency-banner'>} */
    this.parts = render(
      this,
      html`<p class="emergency__title inline-row nowrap">${severityMark(GRAVEST)}<b class="lost">${t('emergency.title')}</b></p>
        <ul class="small-sign stack gap-1 grow shrinks" data-part="list" aria-live="polite"></ul>
        <a class="button button--small button--danger" download
          href="${exportPath(id, 'emergency')}">${icon('download')}<span class="word-if-wide">${t('emergency.sheet')}</span></a>`,
    );
    this.listen([this.desk.observations, this.#alerts], 'change', () => this.#show());
    // A notification requires that the tag has reached the server.
    this.listen(this.desk.outbox, 'answered', () => this.#grave.length > 0 && this.#alerts.follow());
    this.listen(this.parts.list, 'click', ({ target }) => {
      const link = target.closest('[data-observation]');
      if (link) this.desk.goTo(link.dataset.observation);
    });
    this.#show();
  }

  get #grave() {
    return this.desk.observations.value.filter(({ severity }) => severity === GRAVEST);
  }

  #show() {
    const grave = this.#grave;
    const wasHidden = this.hidden;
    this.hidden = grave.length === 0;
    if (this.hidden) return;
    if (wasHidden || !this.#alerts.isFollowed) this.#alerts.follow();
    renderNew(
      this.parts.list,
      html`${grave.slice(0, NAMED).map(
        (item) => html`<li class="row wrap gap-row breaks">
        <button class="link" data-observation="${item.id}">${nameOf(item)}</button>
        ${notification(this.#alerts.value.get(item.id))}</li>`,
      )}
      ${grave.length > NAMED && html`<li>${t('finish.and_more', { n: grave.length - NAMED })}</li>`}`,
    );
  }
}

function notification({ state = null, told_at: at = null, reason = null, error = null } = {}) {
  const says = (sign, text) => html`<span class="inline-row gap-1 shrinks">${icon(sign)}${text}</span>`;
  const why = { reason: reasonText(reason, error) };
  if (state === 'told') return says('check', t('emergency.notified', { time: date(at) }));
  if (state === 'given_up') return says('alert', t('emergency.given_up', why));
  return state && says('wait', error ? t('emergency.not_yet', why) : t('emergency.notifying'));
}

customElements.define('emergency-banner', EmergencyBanner);
