/** How suitable the films were for measuring: which were too fast, too dark, blurred, or lost. */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { count, day, signed } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { framedPage, exportButton } from '../../shared/page-frame/page-frame.js';
import { followList, tableMarkup } from '../../shared/page-frame/list-page.js';
import { column, figures } from '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

/** Problem, and the share that shows it. */
const PROBLEMS = [
  ['lost', 'lost_share'],
  ['too_fast', 'too_fast_share'],
  ['too_dark', 'dark_share'],
  ['overexposed', 'overexposed_share'],
  ['blurred', 'blurred_share'],
  ['lens_dirty', 'dirty_lens_share'],
];

export class QualityPage extends Component {
  mount() {
    /** @type {Parts<'quality-page/quality-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('archive.quality'),
        ways: exportButton(),
        content: html`<p class="dim">${t('quality.help')}</p>
          <div class="choices flow gap-1 pad-1 quality__choices" role="group" aria-label="${t('quality.problem')}" data-part="choices">
            <button class="button button--small" data-problem="">${t('quality.all')}</button>
            ${PROBLEMS.map(([problem]) => html`<button class="button button--small" data-problem="${problem}">${wordFor('film_problem', problem)}</button>`)}</div>
          ${tableMarkup('quality-table', t('quality.nothing'))}`,
      }),
    );
    const { choices } = this.parts;
    const list = followList(this, {
      path: '/api/archive/quality',
      filters: ['problem'],
      rows: 'films',
      caption: t('archive.quality'),
      columns: columns(),
      keyOf: (film) => film.inspection_id,
      show: (_, { filters }) => {
        for (const button of choices.children)
          button.setAttribute('aria-pressed', String(button.dataset.problem === filters.problem));
      },
    });
    this.listen(choices, 'click', ({ target }) => {
      const problem = target.closest('[data-problem]')?.dataset.problem;
      if (problem === undefined) return;
      const share = PROBLEMS.find(([name]) => name === problem)?.[1] ?? '';
      orToast(() => list.want({ problem, sort: share, descending: share && 'true' }));
    });
  }
}

/** '12.3 %', with a sign where it is a problem: colour alone would not show it. */
const shareMarkup = (share, isProblem) =>
  share === null
    ? null
    : html`<span class="number ${isProblem && 'quality__problem inline-row gap-1 lost nowrap'}">${isProblem && icon('alert')}${signed(100 * share, 1)} %</span>`;

const columns = () => [
  column(
    'film',
    t('archive.film'),
    ({ inspection_id: id, name, asset, project }) =>
      html`<a href="/inspections/${id}">${name}</a><small>${[asset, project].filter(Boolean).join(' · ')}</small>`,
    'name',
    '26%',
  ),
  figures('day', t('search.day'), ({ surveyed_on: on }) => day(on), 'surveyed_on'),
  figures('frames', t('quality.frames'), ({ frames }) => count(frames)),
  ...PROBLEMS.map(([problem, share]) =>
    figures(
      problem,
      wordFor('film_problem', problem),
      (film) => shareMarkup(film[share], film.problems.includes(problem)),
      share,
    ),
  ),
  figures('weak', t('quality.weak'), ({ weak_share: share }) => shareMarkup(share, false), 'weak_share'),
];

customElements.define('quality-page', QualityPage);
