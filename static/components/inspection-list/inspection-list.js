/** The start page: all inspections, newest first, kept fresh while something runs. */

import { get, poll, post } from '../../core/api.js';
import { html, patchList, render } from '../../core/html.js';
import { isUnfinished } from '../../core/inspection.js';
import { Component } from '../../core/store.js';
import { date, duration, metresNumber } from '../../core/units.js';
import { icon } from '../icon/icon.js';
import { severityMark, severityText } from '../severity-mark/severity-mark.js';
import { statusChip } from '../status-chip/status-chip.js';

const POLL_BUSY_S = 1.5;
const POLL_IDLE_S = 15;

class InspectionList extends Component {
  mount() {
    document.title = 'Inspections · Chainage';
    this.parts = render(
      this,
      html`<header class="topbar">
          <a class="brand" href="/">${icon('logo')}Chainage</a>
          <span class="spacer"></span>
          <button class="button button--quiet" data-part="leave">${icon('leave')}Log out</button>
        </header>
        <main id="main" class="content" tabindex="-1">
          <div class="content__head">
            <h1>Inspections</h1>
            <a class="button button--primary" href="/new">${icon('plus')}New inspection</a>
          </div>
          <p class="message message--error" data-part="fault" role="alert" hidden></p>
          <section class="panel empty" data-part="empty" hidden>
            <h2>No inspections yet</h2>
            <p class="dim">Take the video of a drive through a culvert, tell Chainage which camera it was and
              how large the pipe is. You get the distance of every frame, and of every defect you mark.</p>
            <a class="button button--primary" href="/new">${icon('plus')}Start the first one</a>
          </section>
          <div class="inspections" data-part="table" hidden>
            <div class="inspections__head" aria-hidden="true">
              <span>Name</span><span>Status</span><span>Length</span><span>Defects</span><span>Worst</span>
              <span>Created</span>
            </div>
            <ul data-part="rows" aria-label="Inspections"></ul>
          </div>
        </main>`,
    );
    this.listen(this.parts.leave, 'click', async () => {
      await post('/api/logout');
      location.assign('/login');
    });
    poll(() => this.#load(), this.signal, (error) => this.#showFault(error.message));
  }

  async #load() {
    const { inspections } = await get('/api/inspections', this.signal);
    this.#showFault(null);
    this.parts.empty.hidden = inspections.length > 0;
    this.parts.table.hidden = inspections.length === 0;
    const newestFirst = inspections.toSorted((a, b) => b.created_at.localeCompare(a.created_at));
    patchList(this.parts.rows, newestFirst, ({ id }) => id, createRow, updateRow);
    return inspections.some(isUnfinished) ? POLL_BUSY_S : POLL_IDLE_S;
  }

  #showFault(text) {
    this.parts.fault.hidden = text === null;
    if (text) render(this.parts.fault, html`${icon('alert')}<span>${text} Trying again…</span>`);
  }
}

function createRow({ id }) {
  const item = document.createElement('li');
  item.className = 'inspection panel';
  item.parts = render(
    item,
    html`<div class="inspection__name">
        <a href="/inspections/${id}" data-part="name"></a>
        <span class="dim" data-part="source"></span>
      </div>
      <div class="inspection__status">
        <span data-part="chip"></span>
        <span class="inspection__progress" data-part="progress">
          <progress class="bar" data-part="bar" max="1" aria-label="Tracking progress"></progress>
          <span class="dim number" data-part="pace"></span>
        </span>
        <span class="inspection__error" data-part="error"></span>
      </div>
      <div class="inspection__fact"><span class="label">Length</span><b class="number" data-part="length"></b></div>
      <div class="inspection__fact"><span class="label">Defects</span><b class="number" data-part="defects"></b></div>
      <div class="inspection__fact"><span class="label">Worst</span><span data-part="worst"></span></div>
      <time class="dim number" data-part="created"></time>`,
  );
  return item;
}

function updateRow({ parts }, inspection) {
  const { name, status, progress, distance_m, defects, worst_severity, created_at } = inspection;
  const { header, source, error } = inspection;
  parts.name.textContent = name;
  parts.source.textContent = [header?.asset_id, source.filename].filter(Boolean).join(' · ');
  render(parts.chip, statusChip(status));
  parts.progress.hidden = !isUnfinished(inspection);
  parts.bar.value = progress.frames_total ? progress.frames_done / progress.frames_total : 0;
  parts.pace.textContent = status === 'running' ? pace(progress) : 'waits for its turn';
  parts.error.textContent = error?.detail ?? '';
  parts.length.textContent = `${metresNumber(distance_m)} m`;
  parts.defects.textContent = String(defects);
  render(
    parts.worst,
    worst_severity === null
      ? html`<span class="dim">–</span>`
      : html`<span class="inspection__worst" title="${severityText(worst_severity)}">
          ${severityMark(worst_severity)}<b>${worst_severity}</b></span>`,
  );
  parts.created.dateTime = created_at;
  parts.created.textContent = date(created_at);
}

/** '63 % · 84 frames/s · 20 s left' */
export function pace({ frames_done, frames_total, fps, eta_s }) {
  const done = frames_total
    ? `${Math.min(100, Math.floor((100 * frames_done) / frames_total))} %`
    : `${frames_done} frames`;
  const speed = fps ? `${Math.round(fps)} frames/s` : null;
  const left = eta_s === null || eta_s === undefined ? null : `${duration(eta_s)} left`;
  return [done, speed, left].filter(Boolean).join(' · ');
}

customElements.define('inspection-list', InspectionList);
