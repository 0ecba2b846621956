/** The sections of the page in the order of the job, and the parts of each. */

import { may } from '../../../core/page/rights.js';
import { t } from '../../../core/page/words.js';

/**
 * @typedef {object} Section
 * @property {string} path
 * @property {string} name
 * @property {import('../icon/icon.js').IconName} sign
 * @property {string[]} [others] paths that belong to it, beside those below its own
 * @property {[string, string][]} [parts] path and name of its pages, where it has several
 */

/** @type {Section[]} */
export const SECTIONS = [
  { path: '/', name: t('work.title'), sign: 'flag' },
  { path: '/inspections', name: t('list.title'), sign: 'video', others: ['/new', '/compare'] },
  {
    path: '/assets',
    name: t('archive.assets'),
    sign: 'layers',
    parts: [
      ['/assets', t('nav.list')],
      ['/assets/map', t('archive.map')],
      ['/assets/register', t('archive.register')],
      ['/assets/projects', t('archive.projects')],
    ],
  },
  { path: '/find', name: t('nav.find'), sign: 'search' },
  {
    path: '/films',
    name: t('archive.films'),
    sign: 'film',
    parts: [
      ['/films', t('nav.intake')],
      ['/films/failures', t('archive.failures')],
      ['/films/rules', t('archive.rules')],
      ['/films/quality', t('archive.quality')],
    ],
  },
  {
    path: '/settings',
    name: t('settings.title'),
    sign: 'settings',
    parts: [
      ['/settings', t('nav.yours')],
      .../** @type {[string, string][]} */ (
        may('admin')
          ? [
              ['/settings/access', t('users.title')],
              ['/settings/detectors', t('detectors.title')],
            ]
          : []
      ),
      ['/settings/template', t('archive.template')],
    ],
  },
];

/**
 * Returns the section that a path belongs to.
 * @param {string} path
 */
export const sectionOf = (path) =>
  SECTIONS.find((section) => section.path === path || section.others?.includes(path)) ??
  SECTIONS.find((section) => section.path !== '/' && path.startsWith(`${section.path}/`)) ??
  SECTIONS[0];
