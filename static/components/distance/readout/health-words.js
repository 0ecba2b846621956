/** Describes how a frame was tracked: a sentence, and its level. */

import { t, wordFor } from '../../../core/page/words.js';

/** More complaints do not help the driver. */
const MOST_NAMED = 2;

/** The levels from good to bad. */
export const LEVELS = ['none', 'ok', 'weak', 'lost'];

/**
 * @param {'ok'|'weak'|'lost'|null} status null: not tracked
 * @param {{overlap: number, fixed_pattern: number, complaints: string[]}|null} health
 * @param {number} lostS since the last frame that was not lost
 * @param {boolean} isAround whether the robot stands and its camera looks around
 * @param {boolean} isUseful whether the interval is narrow enough
 * @returns {{level: string, what: string, text: string}} what: changes when the text should be announced
 */
export function healthWords(status, health, lostS, isAround, isUseful) {
  if (!status) return { level: 'none', what: '', text: t('readout.none') };
  const names = (health?.complaints ?? []).slice(0, MOST_NAMED);
  const why = names.map((name) => wordFor('readout_complaint', name, { percent: shareOf(name, health) })).join(' · ');
  if (isAround && status !== 'lost') return { level: status, what: 'around', text: t('readout.looking_around') };
  const what = `${status} ${names}`;
  if (status !== 'lost' && !isUseful) return { level: 'weak', what: 'useless', text: t('readout.useless') };
  const level = status === 'ok' && why ? 'weak' : status;
  return { level, what, text: upperFirst(sentence(status, why, lostS)) };
}

function sentence(status, why, lostS) {
  if (status === 'lost') {
    const lost = t('readout.lost', { s: lostS.toFixed(1) });
    return why ? t('readout.because', { what: lost, why }) : lost;
  }
  if (status === 'weak') return t('readout.weak', { why: why || t('readout.unsure') });
  return why || t('readout.ok');
}

/** What share of the picture a complaint is about, in percent. */
const shareOf = (name, { overlap, fixed_pattern: fixed }) => Math.round(100 * (name === 'too_fast' ? overlap : fixed));

export const upperFirst = (text) => text.charAt(0).toUpperCase() + text.slice(1);
