/** The defects that must not wait: where they are, the act-now sheet, and who was notified. */

import { Alerts, reasonText } from '../../../core/server/alerts.js';
import { exportPath } from '../../../core/survey/exports.js';
import { html, render } from '../../../core/page/html.js';
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
      html`<p class="emergency__title inline-row nowrap">${severityMark(GRAVEST)}<b>${t('emergency.title')}</b></p>
        <ul class="emergency__list stack gap-1 grow shrinks" data-part="list" aria-live="polite"></ul>
        <a class="button button--small button--danger emergency__sheet" download
          href="${exportPath(id, 'emergency')}">${icon('download')}<span>${t('emergency.sheet')}</span></a>`,
    );
    this.listen(this.desk.observations, 'change', () => this.#show());
    this.listen(this.#alerts, 'change', () => this.#show());
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
    const markup = html`${grave.slice(0, NAMED).map(
      (item) => html`<li>
        <button class="link" data-observation="${item.id}">${nameOf(item)}</button>
        ${this.#notification(this.#alerts.value.get(item.id))}</li>`,
    )}
      ${grave.length > NAMED && html`<li>${t('finish.and_more', { n: grave.length - NAMED })}</li>`}`;
    if (this.parts.list.dataset.shows === markup.text) return;
    this.parts.list.dataset.shows = markup.text;
    render(this.parts.list, markup);
  }

  #notification(alert) {
    switch (alert?.state) {
      case 'told':
        return html`<span>${icon('check')}${t('emergency.notified', { time: date(alert.told_at) })}</span>`;
      case 'waiting':
        return html`<span>${icon('wait')}${
          alert.error
            ? t('emergency.not_yet', { reason: reasonText(alert.reason, alert.error) })
            : t('emergency.notifying')
        }</span>`;
      case 'given_up':
        return html`<span>${icon('alert')}${t('emergency.given_up', { reason: reasonText(alert.reason, alert.error) })}</span>`;
      default:
        return null;
    }
  }
}

customElements.define('emergency-banner', EmergencyBanner);
