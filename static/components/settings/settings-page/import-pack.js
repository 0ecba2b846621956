/** The dialog that imports a code pack: what is in the file, or every fault of it, before anything is kept. */

import { bodyOf, get, send } from '../../../core/server/api.js';
import { labelOf } from '../../../core/defects/codes.js';
import { html, render } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { closesWhenSent, formFoot, openDialog, orFault } from '../../shared/dialog/dialog.js';

const FILES = '.xlsx,.csv,text/csv';

/**
 * @param {import('../../../core/defects/packs.js').Pack[]} known
 * @returns {Promise<string|null>} name of what was imported
 */
export async function importPack(known) {
  const opened = openDialog({
    title: t('settings.pack_import'),
    content: html`<form method="dialog" class="stack gap-4" data-part="form" novalidate>
      <div class="field"><label for="pack-file">${t('settings.pack_file')}</label>
        <input class="input" id="pack-file" type="file" accept="${FILES}" data-part="file" /></div>
      <div class="field"><label for="pack-title">${t('settings.pack_title')}</label>
        <input class="input" id="pack-title" maxlength="90" autocomplete="off" aria-describedby="pack-title-help" data-part="name" />
        <span class="help" id="pack-title-help">${t('settings.pack_title_help')}</span></div>
      <div class="field"><label for="pack-project">${t('settings.pack_project')}</label>
        <input class="input" id="pack-project" maxlength="200" autocomplete="off" list="pack-projects" aria-describedby="pack-project-help" data-part="project" />
        <datalist id="pack-projects" data-part="projects"></datalist>
        <span class="help" id="pack-project-help">${t('settings.pack_project_help')}</span></div>
      <div class="stack pack-preview" role="status" data-part="preview"></div>
      ${formFoot(t('settings.pack_import'))}</form>`,
  });
  const { parts, closed } = opened;
  parts.submit.disabled = true;
  let name = null;
  /** @type {Api['PackPreviewOut']|null} */
  let found = null;
  const titled = () => parts.name.value.trim();
  const show = () => {
    render(parts.preview, found ? previewMarkup(found, becoming(known, titled())) : html``);
    parts.submit.disabled = !found || found.faults.length > 0 || !titled();
  };
  const look = async () => {
    const [file] = parts.file.files;
    found = null;
    show();
    if (file) {
      parts.name.value ||= file.name.replace(/\.[^.]+$/, '').slice(0, 90);
      await orFault(parts, async () => (found = await sent('/api/packs/preview', file, { name: titled() || 'x' })));
    }
    show();
  };
  parts.file.addEventListener('change', look);
  parts.name.addEventListener('input', show);
  closesWhenSent(opened, async () => {
    const project = parts.project.value.trim();
    ({ name } = await sent('/api/packs', parts.file.files[0], { name: titled(), ...(project && { project }) }));
  });
  parts.file.focus();
  orFault({ fault: parts.fault }, async () => {
    const { projects } = await get('/api/archive/projects?limit=200');
    render(parts.projects, html`${projects.map(({ name: project }) => html`<option value="${project}"></option>`)}`);
  });
  await closed;
  return name;
}

const sent = async (path, file, query) =>
  bodyOf(
    await send('POST', `${path}?${new URLSearchParams(query)}`, {
      headers: { 'Content-Type': 'text/csv' },
      body: file,
    }),
    'json',
  );

/** Returns the name that the next version of a title has. */
function becoming(known, title) {
  const newest = known.find((pack) => pack.title === title);
  return newest ? `${title} v${newest.version + 1}` : title;
}

/** @param {Api['PackPreviewOut']} preview @param {string} name */
function previewMarkup({ faults, codes, count, ratings }, name) {
  if (faults.length)
    return html`<p class="fault">${t('settings.pack_faults', { n: faults.length })}</p>
      <ul class="pack-preview__list" tabindex="0" aria-label="${t('settings.pack_faults', { n: faults.length })}">${faults.map((fault) => html`<li>${fault}</li>`)}</ul>`;
  return html`<p>${t('settings.pack_found', { codes: count, ratings: ratings.length })}</p>
    <ul class="pack-preview__list" tabindex="0" aria-label="${t('settings.packs')}">${codes.map(
      (row) => html`<li><b>${[row.code, row.char1, row.char2].filter(Boolean).join(' ')}</b> ${labelOf(row)}</li>`,
    )}</ul>
    ${name && html`<p>${t('settings.pack_becomes', { name })}</p>`}`;
}
