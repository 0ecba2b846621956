/** The projects; with ?project=NAME or ?no_project=true one of them and its assets. */

import { get, poll, post, remove } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { count, day } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { assetTableMarkup, fillAssetTable } from '../assets-page/asset-table.js';
import { framedPage, exportButton, factsMarkup, showFault } from '../../shared/page-frame/page-frame.js';
import { followList, searchMarkup, tableMarkup } from '../../shared/page-frame/list-page.js';
import { openBulkExport } from '../../inspections/bulk-export/bulk-export.js';
import { closesWhenSent, formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { column, figures } from '../../shared/data-table/data-table.js';
import { icon } from '../../shared/icon/icon.js';
import { worstMarkup } from '../../shared/severity-mark/severity-mark.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

const POLL_S = 10;

export class ProjectsPage extends Component {
  mount() {
    const query = new URLSearchParams(location.search);
    const isNone = query.get('no_project') === 'true';
    if (isNone || query.has('project')) this.#showOne(isNone ? null : query.get('project'));
    else this.#showAll();
  }

  #showAll() {
    /** @type {Parts<'projects-page/projects-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: t('archive.projects'),
        ways: html`${exportButton()}<button class="button button--primary" data-part="add" data-needs="operator">${icon('plus')}${t('projects.add')}</button>`,
        content: html`${searchMarkup(t('projects.search'))}${tableMarkup('', t('projects.nothing'))}`,
      }),
    );
    this.listen(this.parts.add, 'click', () => orToast(() => makeProject()));
    followList(this, {
      path: '/api/archive/projects',
      filters: ['search'],
      rows: 'projects',
      caption: t('archive.projects'),
      columns: columns(),
      keyOf: ({ project }) => JSON.stringify(project),
      usual: { sort: 'project', descending: 'false' },
    });
  }

  #showOne(project) {
    const query = queryOf(project);
    /** @type {Parts<'projects-page/projects-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: project ?? t('projects.none'),
        ways: html`<a class="button" href="/assets/projects">${icon('back')}${t('archive.projects')}</a>
          <a class="button" href="/inspections?${query}">${icon('video')}${t('projects.inspections')}</a>
          ${
            project !== null &&
            html`<a class="button" href="/find?${query}">${icon('search')}${t('archive.defects')}</a>
            <a class="button" href="/assets/map?${query}">${icon('map')}${t('projects.map')}</a>
            <a class="button" href="/settings/template?${query}">${icon('edit')}${t('archive.template')}</a>`
          }
          <button class="button" data-part="remove" data-needs="operator" hidden>${icon('trash')}${t('projects.remove')}</button>
          <button class="button button--primary" data-part="export" disabled>${icon('download')}${t('list.export')}</button>`,
        content: html`<div class="project-facts pad-head below-4 panel" data-part="facts"></div>${assetTableMarkup()}`,
      }),
    );
    fillAssetTable(this, true);
    this.listen(this.parts.export, 'click', () =>
      orToast(async () => openBulkExport((await get(`/api/inspections/ids?${query}`, this.signal)).ids)),
    );
    this.listen(this.parts.remove, 'click', () =>
      orToast(async () => {
        await remove(`/api/register/projects?${query}`);
        location.assign('/assets/projects');
      }),
    );
    const load = async () => {
      const { projects } = await get(`/api/archive/projects?${query}`, this.signal);
      render(this.parts.facts, projectFacts(projects[0]));
      this.parts.export.disabled = !projects[0]?.inspections;
      // One to which something belongs is known by that.
      this.parts.remove.hidden = !projects[0] || project === null || projects[0].assets + projects[0].inspections > 0;
      return POLL_S;
    };
    poll(load, this.signal, (error) => showFault(this.parts.fault, error));
  }
}

/** Asks for the name of a new project, makes it, and opens it. */
async function makeProject() {
  const opened = openDialog({
    title: t('projects.add'),
    content: html`<form method="dialog" class="stack gap-4" data-part="form" novalidate>
      <div class="field"><label for="project-name">${t('confirm.name')}</label>
        <input class="input" id="project-name" maxlength="200" autocomplete="off" data-part="name" />
        <span class="help">${t('projects.add_help')}</span></div>
      ${formFoot(t('projects.make'))}</form>`,
  });
  opened.parts.name.focus();
  closesWhenSent(opened, async () => {
    const name = opened.parts.name.value.trim();
    await post('/api/register/projects', { name });
    location.assign(`/assets/projects?${queryOf(name)}`);
  });
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
  column(
    'project',
    t('archive.project'),
    ({ project }) => html`<a href="/assets/projects?${queryOf(project)}">${project ?? t('projects.none')}</a>`,
    'project',
  ),
  figures('assets', t('archive.assets'), ({ assets }) => count(assets)),
  figures(
    'inspections',
    t('list.title'),
    ({ project, inspections }) =>
      html`<a class="number" href="/inspections?${queryOf(project)}">${count(inspections)}</a>`,
  ),
  figures('done', t('projects.done'), ({ done, inspections }) => shareMarkup(done, inspections)),
  figures('approved', t('projects.approved'), ({ approved, inspections }) => shareMarkup(approved, inspections)),
  figures('last', t('assets.last'), ({ last_at: at }) => at && day(at), 'last_on'),
  figures('worst', t('projects.worst'), ({ worst_severity: worst }) => worstMarkup(worst), 'worst_severity'),
];

const shareMarkup = (n, all) =>
  html`<span class="project-share"><span class="number">${count(n)}</span>${all > 0 && html`<progress class="bar" max="${all}" value="${n}" aria-label="${t('projects.share', { n: count(n), all: count(all) })}"></progress>`}</span>`;

customElements.define('projects-page', ProjectsPage);
