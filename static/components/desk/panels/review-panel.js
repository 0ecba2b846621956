/** The review of the inspection: its state with who and when, the next step, the open questions. */

import { ownKey } from '../../../core/page/keys.js';
import { html, renderNew } from '../../../core/page/html.js';
import { isForAdmins, nextStates } from '../../../core/defects/review.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { date } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { nameOf } from '../../defects/defect-list/names.js';
import { icon } from '../../shared/icon/icon.js';
import { reviewChip } from '../../shared/status-chip/status-chip.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';
import { openAcceptance } from '../../reports/acceptance/acceptance.js';
import { clientSection, replyTo } from './client-answers.js';
import { goToQuestion, pressed, remarkRow } from './remarks.js';
import { askStep } from './steps.js';

export class ReviewPanel extends Component {
  mount() {
    this.desk = this.closest('inspection-page').desk;
    const { desk } = this;
    this.classList.add('review');
    this.listen(this, 'click', (event) => {
      const found = event.target.closest('[data-move], [data-next], [data-reply], [data-client]')?.dataset ?? {};
      const { move, next, reply, client } = found;
      orToast(async () => {
        if (move) await this.#move(move);
        else if (reply)
          await replyTo(
            desk.review,
            desk.review.value.said.find(({ id }) => id === reply),
          );
        else if (client !== undefined) await openAcceptance([desk.inspection.id], desk.inspection.id);
        else if (next !== undefined) goToQuestion(desk);
        else await pressed(desk, event);
      });
    });
    this.listen([desk.review, desk.inspection, desk.observations], 'change', () => this.#show());
    this.#show();
  }

  async #move(state) {
    const { desk } = this;
    const blocking = (desk.checks.value ?? []).filter(({ level }) => level === 'block').length;
    const chosen = await askStep(state, state === 'reopened' ? 0 : blocking);
    if (chosen === null) return;
    if (desk.hasRefused) {
      desk.fault(t('reviewing.undecided'));
      return;
    }
    await desk.whenSent(this.signal);
    await desk.review.move(state, chosen.reason);
    await desk.inspection.load();
    desk.done(t('reviewing.moved', { state: wordFor('review', state) }), { action: null });
  }

  #show() {
    const { desk } = this;
    const { value: review } = desk.review;
    if (review === null) return;
    const { value: defects } = desk.observations;
    const { questions, waiting } = desk.review;
    const accepted = defects.filter((item) => desk.review.isAccepted(item)).length;
    renderNew(
      this,
      html`<div class="stack gap-3 pad-head line-below">
          <p role="status">${reviewChip(review.state)} ${review.by && html`<span class="dim">${t('reviewing.by', { who: review.by, when: date(review.at) })}</span>`}</p>
          ${this.#stepsMarkup(review.state)}
        </div>
        <section class="stack gap-3 pad-head line-below" aria-label="${t('remark.question')}">
          <p class="row wrap gap-row"><b>${waiting ? t('reviewing.questions', { n: waiting }) : t('reviewing.no_questions')}</b>
            <span class="dim">${t('reviewing.progress', { accepted, all: defects.length })}</span>
            ${questions.length > 0 && html`<button type="button" class="button button--small" data-next>${t('reviewing.next')}<kbd>${ownKey('Q')}</kbd></button>`}</p>
          <ul>${questions.map((remark) => remarkRow(remark, { name: this.#nameOf(remark) }))}</ul>
        </section>
        ${clientSection(review)}
        <section class="stack gap-3 pad-head line-below">
          <h3>${t('reviewing.steps')}</h3>
          ${review.steps.length === 0 && html`<p class="dim">${t('reviewing.no_steps')}</p>`}
          <ol>${review.steps.toReversed().map(
            ({ state, by, at, reason }) => html`<li class="remark entry sign-dim">${icon('forward')}
            <div><p><b>${wordFor('review', state)}</b></p>${reason && html`<p class="remark__text breaks">${reason}</p>`}
            <p class="dim small">${t('reviewing.by', { who: by, when: date(at) })}</p></div></li>`,
          )}</ol>
        </section>`,
    );
  }

  #nameOf({ observation }) {
    const item = this.desk.observations.find(observation);
    return item ? nameOf(item) : t('history.deleted_defect');
  }

  #stepsMarkup(state) {
    if (!may('operator')) return null;
    if (this.desk.inspection.isUnfinished) return html`<p class="dim">${t('reviewing.not_ended')}</p>`;
    const isAllowed = (wanted) => may(isForAdmins(state, wanted) ? 'admin' : 'operator');
    const steps = nextStates(state);
    return html`<p class="row wrap gap-row">${steps.map(
      (wanted, i) => html`<button type="button" class="button ${i === 0 && 'button--primary'}"
        data-move="${wanted}" ${!isAllowed(wanted) && 'disabled'}>${wordFor('review_step', wanted)}</button>`,
    )}</p>
      ${!steps.every(isAllowed) && html`<p class="dim">${t('reviewing.for_admins')}</p>`}`;
  }
}

customElements.define('review-panel', ReviewPanel);
