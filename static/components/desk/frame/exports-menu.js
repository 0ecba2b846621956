/** The menu of everything that an inspection can be exported as. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { EMERGENCY, GROUPS } from '../../reports/export-dialog/formats.js';

const exportMarkup = ({ kind, name, help }) => html`<button class="menu__item" data-export="${kind}"><b>${name}</b>
  <span class="dim">${help}</span></button>`;

/** @param {string} id of the inspection; the part `emergency` is for a defect that cannot wait */
export const exportsMarkup = (id) => html`<div class="menu__list menu__list--exports panel">
  <div class="menu__group" data-part="emergency" hidden>${exportMarkup(EMERGENCY)}</div>
  ${GROUPS.map(
    ({ title, formats }, i) => html`<section class="menu__group" aria-labelledby="exports-${i}">
    <h2 class="menu__title help strong" id="exports-${i}">${title}</h2>
    <ul>${formats.map((format) => html`<li>${exportMarkup(format)}</li>`)}</ul></section>`,
  )}
  <section class="menu__group" aria-labelledby="exports-other">
    <h2 class="menu__title help strong" id="exports-other">${t('export.other')}</h2>
    <ul><li><a class="menu__item" download href="/api/inspections/${id}/track?format=csv"><b>${t('desk.export_track')}</b>
        <span class="dim">${t('desk.export_track_help')}</span></a></li>
      <li><a class="menu__item" href="/compare?a=${id}"><b>${t('compare.with')}</b>
        <span class="dim">${t('compare.with_help')}</span></a></li></ul></section></div>`;
