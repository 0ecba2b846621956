/** How far the archive is as a whole: films by state, speed, time left, and what tracks them. */

import { html } from '../../../core/page/html.js';
import { may } from '../../../core/page/rights.js';
import { bytes, count, duration } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';
import { FILM_STATES, statusSign } from '../../shared/status-chip/status-chip.js';

/**
 * @param {object} progress answer of the API
 * @param {number} all number of films
 */
export function progressMarkup(
  { states, films_done: done, fps, films_per_h: filmsPerH, eta_s: etaS, engine, intake },
  all,
) {
  const percent = Math.floor((100 * done) / all);
  return html`<div class="stack">
      <p><b class="number">${t('archive.done_of', { done: count(done), all: count(all), percent })}</b></p>
      <progress class="bar" max="${all}" value="${done}" aria-label="${t('archive.progress')}"></progress>
    </div>
    <dl class="archive-progress__facts facts flow">
      ${fact(t('archive.speed'), filmsPerH === null ? '–' : t('archive.speed_value', { films: count(Math.round(filmsPerH)), fps: fps === null ? '–' : count(Math.round(fps)) }))}
      ${fact(t('archive.left'), etaS === null ? '–' : duration(etaS))}
      ${fact(t('archive.engine'), html`${engineName(engine)}${engine.dashboard_url && html` · <a href="${engine.dashboard_url}" target="_blank" rel="noopener noreferrer">${t('archive.dashboard')}</a>`}`)}
    </dl>
    ${states.ready && may('operator') && html`<button class="button button--primary archive-progress__start" data-start-all>${icon('play')}${t('archive.start_all', { n: states.ready, count: count(states.ready) })}</button>`}
    <ul class="flow whole-row" aria-label="${t('archive.by_state')}">${FILM_STATES.filter((state) => states[state]).map(
      (state) =>
        html`<li><button class="button button--small chip--${state}" data-go="${state}">${statusSign(state)}${wordFor('status', state)} <b class="number">${count(states[state])}</b></button></li>`,
    )}</ul>
    ${intake.name && html`<p class="dim number">${t('archive.intake', { name: intake.name, done: bytes(intake.bytes_done), all: bytes(intake.bytes_total) })}</p>`}
    ${engine.problem && message('error', engine.problem)}
    ${intake.hindrance && message('warning', intake.hindrance)}`;
}

const fact = (title, value) => html`<div><dt>${title}</dt><dd class="number">${value}</dd></div>`;

function engineName({ kind, workers }) {
  const name = wordFor('engine', kind) ?? kind;
  return t('archive.workers', { n: workers, name });
}
