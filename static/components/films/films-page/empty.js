/** What the intake is and how it begins, for whoever has no films in it yet. */

import { html } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { pieces, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

export const emptyIntake = () => html`<h2>${t('archive.empty')}</h2>
  <p>${t('archive.empty_text')}</p>
  <ol class="steps stack">
    <li>${pieces('archive.empty_rules', { rules: html`<a href="/films/rules">${t('archive.rules')}</a>` })}</li>
    <li>${t('archive.empty_folder')}</li>
    <li>${t('archive.empty_add')}</li>
    <li>${t('archive.empty_start')}</li>
  </ol>
  ${may('admin') && html`<a class="button button--primary" href="/films/add">${icon('plus')}${t('archive.add')}</a>`}`;
