/** What a film needs whose wall the camera does not recognise: the unit of its counter, or typed distances. */

import { html, render } from '../../../core/page/html.js';
import { mayEdit } from '../../../core/page/rights.js';
import { lostRuns } from '../../../core/survey/lost.js';
import { BY_CAMERA, SOURCES } from '../../../core/survey/track.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

/** A film of which so much is lost needs another source of its distances. */
const MUCH = 0.1;

export class DistanceNotice extends Component {
  #shown = '';

  mount() {
    this.page = this.closest('inspection-page');
    this.desk = this.page.desk;
    this.classList.add('message', 'message--warning');
    this.setAttribute('role', 'status');
    const { counter, track, inspection } = this.desk;
    this.listen([counter, track, inspection], 'change', () => this.#show());
    this.listen(this, 'click', ({ target }) => this.#clicked(target.closest('button')?.dataset ?? {}));
    this.#show();
  }

  #show() {
    const what = mayEdit() ? this.#needed() : null;
    this.hidden = what === null;
    if (what === this.#shown || what === null) return;
    this.#shown = what;
    const [kind, percent] = what.split(' ');
    const unit = (name) =>
      html`<button type="button" class="button button--small" data-unit="${name}">${name}</button>`;
    render(
      this,
      html`${icon('alert')}<div class="row wrap gap-3">${
        kind === 'unit'
          ? html`<span>${t('notice.counter_unit')}</span>${unit('m')}${unit('ft')}`
          : html`<span>${t('notice.much_lost', { percent })}</span>
              <button type="button" class="button button--small" data-type>${t('typed.begin')}</button>`
      }</div>`,
    );
  }

  /** 'unit', 'typed 83' with the percentage of lost frames, or null. */
  #needed() {
    const { counter, track, inspection } = this.desk;
    if (inspection.isUnfinished || track.length === 0) return null;
    const lost = lostRuns(track.column('status')).reduce((sum, { first, last }) => sum + last + 1 - first, 0);
    const own = track.column('source').filter((source) => BY_CAMERA.has(SOURCES[source])).length;
    const read = counter.value;
    const isPoor = lost > MUCH * track.length || inspection.value.is_useful === false;
    if (!isPoor || own < track.length || read?.state === 'waiting') return null;
    if (read?.state === 'read' && read.legible > 0 && read.unit === null) return 'unit';
    return lost > MUCH * track.length ? `typed ${Math.round((100 * lost) / track.length)}` : null;
  }

  #clicked({ unit, type }) {
    const { counter, tab } = this.desk;
    if (unit) orToast(() => counter.state({ ...counter.stated, unit }));
    if (type === undefined) return;
    tab.set('corrections');
    this.page.querySelector('typed-section').begin();
  }
}

customElements.define('distance-notice', DistanceNotice);
