/** Changes that somebody else was faster with: each waits until a person has compared both versions. */

import { listenTo } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';

/** Keeps the conflicts of a desk in step with what the server has refused. */
export class Overtaken {
  #desk;
  /** Counts the overtaken corrections of this page, so that each conflict gets a new id. */
  #found = 0;

  /** @param {Desk} desk @param {AbortSignal} signal */
  constructor(desk, signal) {
    this.#desk = desk;
    const { outbox, corrections } = desk;
    outbox.addEventListener('change', () => this.#findObservations(), { signal });
    listenTo([corrections, corrections.draft], 'change', signal, () => this.#findDraft());
    this.#findObservations();
  }

  /** Reports the draft of the corrections, which waits, as another conflict than those before it. */
  stateDraft() {
    const { corrections, conflicts } = this.#desk;
    const { stated: theirs, version } = corrections.value;
    const { remark } = corrections.waiting;
    this.#found += 1;
    conflicts.state('corrections', [
      {
        id: `corrections ${this.#found}`,
        kind: 'corrections',
        get mine() {
          return corrections.draft.value; // it may be edited until then
        },
        theirs,
        keepMine: async () => {
          if (await this.#desk.correct(corrections.draft.value, remark, version))
            this.#desk.done(t('corrections.applied'));
        },
        takeTheirs: () => corrections.discard(),
      },
    ]);
  }

  /** Reports a draft that waits for a decision, also since an earlier page, until it is settled. */
  #findDraft() {
    const { corrections, conflicts } = this.#desk;
    if (!corrections.isOvertaken) conflicts.state('corrections', []);
    else if (corrections.waiting && !conflicts.value.some(({ kind }) => kind === 'corrections')) this.stateDraft();
  }

  /** Reports changes that the server refused because somebody else changed the same observation. */
  #findObservations() {
    const { outbox, observations, inspection, conflicts } = this.#desk;
    conflicts.state(
      'observation',
      outbox.overtakenFor(inspection.id).map(({ id, observation, fields, refusal }) => ({
        id,
        kind: 'observation',
        about: observation,
        mine: fields ?? null,
        theirs: refusal.current,
        keepMine: () => observations.sendAgain(observation),
        takeTheirs: () => observations.giveUp(observation),
      })),
    );
  }
}
