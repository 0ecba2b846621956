/** One inspection in the list. */

import { html, render, renderNew } from '../../../core/page/html.js';
import { hasFilm, isUnfinished } from '../../../core/survey/inspection.js';
import { isLocked } from '../../../core/defects/review.js';
import { may } from '../../../core/page/rights.js';
import { chainage, date, duration } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { likeButton } from '../../shared/page-frame/page-frame.js';
import { icon } from '../../shared/icon/icon.js';
import { labelFilters } from '../labels/labels.js';
import { GRAVEST, worstMarkup } from '../../shared/severity-mark/severity-mark.js';
import { outdatedFilter, reviewChip, statusChip } from '../../shared/status-chip/status-chip.js';
import { thumbnail, thumbnailImage } from '../../shared/thumbnail/thumbnail.js';

/** Whether it has a defect of the highest severity. */
const isGrave = ({ worst_severity: worst }) => worst === GRAVEST;

/** A draft without a question needs no word. */
const reviewMarkup = ({ review: { state }, open_questions: n }) =>
  html`${state !== 'draft' && reviewChip(state)} ${n > 0 && html`<span class="chip chip--reopened">${icon('help')}${t('reviewing.questions', { n })}</span>`}`;

const graveChip = () =>
  html`<span class="chip chip--grave">${icon('alert')}${wordFor('severity', String(GRAVEST))}</span>`;

export function createRow(id) {
  const item = document.createElement('li');
  item.className = 'inspection panel';
  item.parts = render(
    item,
    html`<label class="inspection__mark"><span class="visually-hidden" data-part="markName"></span><input type="checkbox" data-mark="${id}" /></label>
      ${thumbnail(null)}
      <div class="inspection__name stack gap-0 shrinks">
        <a class="plain strong one-line" href="/inspections/${id}" data-part="name"></a>
        <span class="inspection__about help one-line" data-part="about"></span>
        <span class="label-chips unless-empty" data-part="labels"></span>
      </div>
      <div class="inspection__status stack gap-1 at-start">
        <span data-part="chip"></span>
        <span class="inspection__progress stack full small" data-part="progress">
          <progress class="bar" data-part="bar" max="1" aria-label="${t('progress.label')}"></progress>
          <span class="dim number" data-part="pace"></span>
        </span>
        <span class="unless-empty small lost" data-part="error"></span>
      </div>
      <div class="inspection__fact"><span class="label help">${t('list.length')}</span><b class="number" data-part="length"></b></div>
      <div class="inspection__fact"><span class="label help">${t('list.defects')}</span><b class="number" data-part="defects"></b></div>
      <div class="inspection__fact"><span class="label help">${t('list.worst')}</span><span data-part="worst"></span></div>
      <time class="dim number" data-part="created"></time>
      <div class="inspection__actions row gap-0 holds">
        <button class="button button--quiet button--small button--icon" data-part="label" data-needs="operator">${icon('label')}</button>
        <button class="button button--quiet button--small button--icon" data-part="rename" data-needs="operator">${icon('edit')}</button>
        <button class="button button--quiet button--small button--icon" data-part="remove" data-needs="admin">${icon('trash')}</button>
      </div>`,
  );
  return item;
}

export function updateRow(item, inspection) {
  const { parts, classList } = item;
  const { id, name, status, progress, distance_m, defects, worst_severity, created_at, labels, error } = inspection;
  parts.name.textContent = name;
  parts.markName.textContent = t('list.select', { name });
  renderNew(parts.about, aboutMarkup(inspection));
  renderNew(parts.labels, labelFilters(labels));
  // Another state may have another picture.
  const state = [status, worst_severity, defects].join('-');
  if (hasFilm(inspection) && item.dataset.state !== state) render(parts.picture, thumbnailImage(id, state));
  item.dataset.state = state;
  render(
    parts.chip,
    html`${statusChip(status, inspection)} ${outdatedFilter(inspection.outdated)} ${isGrave(inspection) && graveChip()} ${reviewMarkup(inspection)}`,
  );
  parts.progress.hidden = !isUnfinished(inspection);
  parts.bar.value = progress.frames_total ? progress.frames_done / progress.frames_total : 0;
  parts.pace.textContent = status === 'running' ? pace(progress) : t('progress.waits');
  parts.error.textContent = error ? errorText(error) : '';
  parts.length.textContent = chainage(distance_m);
  parts.defects.textContent = String(defects);
  render(parts.worst, worstMarkup(worst_severity));
  classList.toggle('inspection--grave', isGrave(inspection));
  parts.created.dateTime = created_at;
  parts.created.textContent = date(created_at);
  for (const [part, label] of [
    ['label', t('labels.title', { name })],
    ['rename', t('list.rename_named', { name })],
    ['remove', t('list.delete_named', { name })],
  ]) {
    parts[part].setAttribute('aria-label', label);
  }
  parts.label.title = t('labels.change');
  parts.rename.title = t('list.rename');
  const isOpen = !isLocked(inspection);
  parts.rename.disabled = !isOpen;
  parts.remove.title = may('admin') ? t('list.delete') : t('rights.admin');
  parts.remove.disabled = !may('admin') || !isOpen;
}

/** Asset, project and file; the first two narrow the list to their like. */
const aboutMarkup = ({ asset, project, source }) =>
  html`${asset && likeButton('asset', asset)}${asset && ' · '}${project && likeButton('project', project)}${project && ' · '}<span class="inspection__file">${source.filename}</span>`;

/** '63 % · 84 frames/s · 20 s left' */
export function pace({ frames_done, frames_total, fps, eta_s }) {
  const done = frames_total
    ? t('progress.percent', { percent: Math.min(100, Math.floor((100 * frames_done) / frames_total)) })
    : t('progress.frames', { n: frames_done });
  const speed = fps ? t('progress.speed', { fps: Math.round(fps) }) : null;
  const isKnown = eta_s !== null && eta_s !== undefined;
  const left = isKnown ? t('progress.left', { time: duration(eta_s) }) : null;
  return [done, speed, left].filter(Boolean).join(' · ');
}
