/** How suitable the films were for measuring: which were too fast, too dark, blurred, or lost. */

import { html, render } from '../../../core/page/html.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { Component } from '../../../core/page/store.js';
import { count, day, signed } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { archivePage, exportButton, pendingNote, showFault } from '../archive-shell/archive-shell.js';
import '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { closesElsewhere } from '../../shared/menu/menu.js';
import '../../shared/pager/pager.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const POLL_S = 10;

/** Problem, and the share that shows it. */
const PROBLEMS = [
  ['lost', 'lost_share'],
  ['too_fast', 'too_fast_share'],
  ['too_dark', 'dark_share'],
  ['overexposed', 'overexposed_share'],
  ['blurred', 'blurred_share'],
  ['lens_dirty', 'dirty_lens_share'],
];

export class ArchiveQuality extends Component {
  mount() {
    /** @type {Parts<'archive-quality/archive-quality'>} */
    this.parts = render(
      this,
      archivePage({
        title: t('archive.quality'),
        ways: exportButton(),
        content: html`<p class="dim">${t('quality.help')}</p>
          <div class="choices flow gap-1 pad-1 quality__choices" role="group" aria-label="${t('quality.problem')}" data-part="choices">
            <button class="button button--small" data-problem="">${t('quality.all')}</button>
            ${PROBLEMS.map(([problem]) => html`<button class="button button--small" data-problem="${problem}">${wordFor('film_problem', problem)}</button>`)}</div>
          <div data-part="pending"></div>
          <data-table class="quality-table" data-part="table"></data-table>
          <p class="panel find__nothing row gap-3 wrap pad-4" data-part="nothing" hidden>${t('quality.nothing')}</p>
          <list-pager data-part="pager"></list-pager>`,
      }),
    );
    const { parts, signal } = this;
    /** @type {PagedList<Api['app__web__schemas__search__FilmsOut']>} */
    const list = new PagedList('/api/archive/quality', { filters: ['problem', 'sort', 'descending'], signal });
    parts.table.fill({ caption: t('archive.quality'), columns: columns(), keyOf: (film) => film.inspection_id, list });
    parts.pager.fill(list);
    closesElsewhere(this.querySelector('.export-all'), signal);
    this.listen(parts.choices, 'click', ({ target }) => {
      const problem = target.closest('[data-problem]')?.dataset.problem;
      if (problem === undefined) return;
      const share = PROBLEMS.find(([name]) => name === problem)?.[1] ?? '';
      orToast(() => list.want({ problem, sort: share, descending: share && 'true' }));
    });
    this.listen(list, 'change', () => {
      const { films, total, pending } = list.value;
      parts.table.show(films);
      parts.table.hidden = total === 0;
      parts.nothing.hidden = total > 0;
      render(parts.pending, pendingNote(pending));
      for (const button of parts.choices.children)
        button.setAttribute('aria-pressed', String(button.dataset.problem === list.filters.problem));
    });
    list.follow(
      () => POLL_S,
      (error) => showFault(parts.fault, error),
    );
  }
}

/** '12.3 %', with a sign where it is a problem: colour alone would not show it. */
const shareCell = (share, isProblem) =>
  share === null
    ? html`<span class="dim">–</span>`
    : html`<span class="number ${isProblem && 'quality__problem inline-row gap-1 lost nowrap'}">${isProblem && icon('alert')}${signed(100 * share, 1)} %</span>`;

const columns = () => [
  {
    name: 'film',
    title: t('archive.film'),
    sort: 'name',
    cell: ({ inspection_id: id, name, asset, project }) =>
      html`<a href="/inspections/${id}">${name}</a><small>${[asset, project].filter(Boolean).join(' · ')}</small>`,
  },
  {
    name: 'day',
    title: t('search.day'),
    sort: 'surveyed_on',
    descends: true,
    cell: ({ surveyed_on: on }) => html`<span class="number">${day(on)}</span>`,
  },
  {
    name: 'frames',
    title: t('quality.frames'),
    sort: 'frames',
    descends: true,
    cell: ({ frames }) => html`<span class="number">${count(frames)}</span>`,
  },
  ...PROBLEMS.map(([problem, share]) => ({
    name: problem,
    title: wordFor('film_problem', problem),
    sort: share,
    descends: true,
    cell: (film) => shareCell(film[share], film.problems.includes(problem)),
  })),
  {
    name: 'weak',
    title: t('quality.weak'),
    sort: 'weak_share',
    descends: true,
    cell: ({ weak_share: share }) => shareCell(share, false),
  },
];

customElements.define('archive-quality', ArchiveQuality);
