/** The projects; with ?project=NAME or ?no_project=true one of them and its assets. */

import { get, poll } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { PagedList } from '../../../core/page/paged-list.js';
import { Component } from '../../../core/page/store.js';
import { count, day } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { assetTableMarkup, fillAssetTable } from '../archive-assets/asset-table.js';
import { archivePage, exportButton, factsMarkup, pendingNote, showFault } from '../archive-shell/archive-shell.js';
import { openBulkExport } from '../bulk-export/bulk-export.js';
import '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { closesElsewhere } from '../../shared/menu/menu.js';
import '../../shared/pager/pager.js';
import { worstMarkup } from '../../shared/severity-mark/severity-mark.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const POLL_S = 10;

export class ArchiveProjects extends Component {
  mount() {
    const query = new URLSearchParams(location.search);
    const isNone = query.get('no_project') === 'true';
    if (isNone || query.has('project')) this.#showOne(isNone ? null : query.get('project'));
    else this.#showAll();
  }

  #showAll() {
    /** @type {Parts<'archive-projects/archive-projects'>} */
    this.parts = render(
      this,
      archivePage({
        title: t('archive.projects'),
        ways: exportButton(),
        content: html`<search class="row gap-3 wrap below-4"><div class="field find__text"><label class="visually-hidden" for="projects-text">${t('projects.search')}</label>
            <input class="input" id="projects-text" type="search" autocomplete="off" maxlength="200" placeholder="${t('projects.search')}" data-part="text" /></div></search>
          <div data-part="pending"></div>
          <data-table data-part="table"></data-table>
          <p class="panel find__nothing row gap-3 wrap pad-4" data-part="nothing" hidden>${t('projects.nothing')}</p>
          <list-pager data-part="pager"></list-pager>`,
      }),
    );
    const { parts, signal } = this;
    /** @type {PagedList<Api['ProjectsOut']>} */
    const list = new PagedList('/api/archive/projects', { filters: ['search', 'sort', 'descending'], signal });
    parts.text.value = list.filters.search;
    parts.table.fill({
      caption: t('archive.projects'),
      columns: columns(),
      keyOf: ({ project }) => JSON.stringify(project),
      list,
      usual: { sort: 'project', descending: 'false' },
    });
    parts.pager.fill(list);
    closesElsewhere(this.querySelector('.export-all'), signal);
    this.listen(parts.text, 'input', () => orToast(() => list.want({ search: parts.text.value })));
    this.listen(list, 'change', () => {
      const { projects, total, pending } = list.value;
      parts.table.show(projects);
      parts.table.hidden = total === 0;
      parts.nothing.hidden = total > 0;
      render(parts.pending, pendingNote(pending));
    });
    list.follow(
      () => POLL_S,
      (error) => showFault(parts.fault, error),
    );
  }

  #showOne(project) {
    const query = queryOf(project);
    /** @type {Parts<'archive-projects/archive-projects'>} */
    this.parts = render(
      this,
      archivePage({
        title: project ?? t('projects.none'),
        ways: html`<a class="button" href="/archive/projects">${icon('back')}${t('archive.projects')}</a>
          <a class="button" href="/?${query}">${icon('video')}${t('projects.inspections')}</a>
          ${
            project !== null &&
            html`<a class="button" href="/archive/defects?${query}">${icon('search')}${t('archive.defects')}</a>
            <a class="button" href="/archive/map?${query}">${icon('map')}${t('projects.map')}</a>
            <a class="button" href="/archive/template?${query}">${icon('edit')}${t('archive.template')}</a>`
          }
          <button class="button button--primary" data-part="export" disabled>${icon('download')}${t('list.export')}</button>`,
        content: html`<div class="project-facts pad-head below-4 panel" data-part="facts"></div>${assetTableMarkup()}`,
      }),
    );
    fillAssetTable(this, true);
    this.listen(this.parts.export, 'click', () =>
      orToast(async () => openBulkExport((await get(`/api/inspections/ids?${query}`, this.signal)).ids)),
    );
    const load = async () => {
      const { projects } = await get(`/api/archive/projects?${query}`, this.signal);
      render(this.parts.facts, projectFacts(projects[0]));
      this.parts.export.disabled = !projects[0]?.inspections;
      return POLL_S;
    };
    poll(load, this.signal, (error) => showFault(this.parts.fault, error));
  }
}

const queryOf = (project) => new URLSearchParams(project === null ? { no_project: 'true' } : { project });

function projectFacts(project) {
  if (!project) return html`<p class="dim">${t('projects.unknown')}</p>`;
  const { assets, inspections, done, approved, last_at: at, worst_severity: worst } = project;
  return factsMarkup([
    [t('archive.assets'), count(assets)],
    [t('list.title'), count(inspections)],
    [t('projects.done'), count(done)],
    [t('projects.approved'), count(approved)],
    [t('assets.last'), at ? day(at) : '–'],
    [t('projects.worst'), worstMarkup(worst)],
  ]);
}

const columns = () => [
  {
    name: 'project',
    title: t('archive.project'),
    sort: 'project',
    cell: ({ project }) => html`<a href="/archive/projects?${queryOf(project)}">${project ?? t('projects.none')}</a>`,
  },
  {
    name: 'assets',
    title: t('archive.assets'),
    sort: 'assets',
    descends: true,
    cell: ({ assets }) => html`<span class="number">${count(assets)}</span>`,
  },
  {
    name: 'inspections',
    title: t('list.title'),
    sort: 'inspections',
    descends: true,
    cell: ({ project, inspections }) => html`<a class="number" href="/?${queryOf(project)}">${count(inspections)}</a>`,
  },
  {
    name: 'done',
    title: t('projects.done'),
    sort: 'done',
    descends: true,
    cell: ({ done, inspections }) => shareMarkup(done, inspections),
  },
  {
    name: 'approved',
    title: t('projects.approved'),
    sort: 'approved',
    descends: true,
    cell: ({ approved, inspections }) => shareMarkup(approved, inspections),
  },
  {
    name: 'last',
    title: t('assets.last'),
    sort: 'last_on',
    descends: true,
    cell: ({ last_at: at }) => html`<span class="number">${at ? day(at) : '–'}</span>`,
  },
  {
    name: 'worst',
    title: t('projects.worst'),
    sort: 'worst_severity',
    descends: true,
    cell: ({ worst_severity: worst }) => worstMarkup(worst),
  },
];

const shareMarkup = (n, all) =>
  html`<span class="project-share"><span class="number">${count(n)}</span>${all > 0 && html`<progress class="bar" max="${all}" value="${n}" aria-label="${t('projects.share', { n: count(n), all: count(all) })}"></progress>`}</span>`;

customElements.define('archive-projects', ArchiveProjects);
