/** All assets on a map, each with the worst grade of its newest inspection; the list beside it has those in sight. */

import { get, pause, poll } from '../../../core/server/api.js';
import { html, patchList, render, renderNew, setText } from '../../../core/page/html.js';
import { bindKeys, withKey } from '../../../core/page/keys.js';
import { Component } from '../../../core/page/store.js';
import { count, day } from '../../../core/wall/units.js';
import { pieces, t, wordFor } from '../../../core/page/words.js';
import { assetPath } from '../assets-page/asset-table.js';
import { framedPage, pendingNote, showFault } from '../../shared/page-frame/page-frame.js';
import { icon } from '../../shared/icon/icon.js';
import { showKeys } from '../../desk/actions/key-help.js';
import { GRADES, severityMark, severityWord } from '../../shared/severity-mark/severity-mark.js';
import { Card, gradeWord } from './card.js';
import './map-canvas.js';
import { placesOf } from './places.js';

const FILTERS = ['project', 'severity_from'];
/** Rows of the list beside the map. */
const MOST_LISTED = 50;
/** Pause after a movement before list and address follow. */
const SETTLE_S = 0.2;
/** Seconds until the server is asked again: while it reads inspections in, and else. */
const POLL_PENDING_S = 10;
const POLL_S = 300;
const LAT_LON_DECIMALS = 5;
const ZOOM_DECIMALS = 2;

export class MapPage extends Component {
  #places = [];
  #filters = {};
  /** Projects to choose from, a line each. */
  #offered;
  #card;
  /** Ends with the question to the server. */
  #asked = new AbortController();
  /** Ends with the movement of the map. */
  #moving = new AbortController();
  /** Where the map looks once the answer is there: a look, 'all', or null for where it looks now. */
  #next;

  mount() {
    const query = new URLSearchParams(location.search);
    this.#filters = Object.fromEntries(FILTERS.map((name) => [name, query.get(name) ?? '']));
    this.#next = lookOf(query.get('at')) ?? 'all';
    /** @type {Parts<'map-page/map-page'>} */
    this.parts = render(this, framedPage({ title: t('archive.map'), content: contentMarkup() }));
    const { parts, signal } = this;
    this.#card = new Card(parts.card, signal);
    parts.severity_from.value = this.#filters.severity_from;
    this.#offerProjects([]);
    this.listen(parts.form, 'change', () => this.#filter());
    this.listen(parts.map, 'move', () => {
      this.#card.close();
      if (this.answer) this.#settle(); // before it the address says where to look, and nothing is in sight
    });
    this.listen(parts.map, 'point', ({ detail }) => this.#card.point(detail));
    this.listen(parts.map, 'pick', ({ detail }) => this.#pick(detail));
    this.listen(parts.zoomIn, 'click', () => parts.map.zoomIn());
    this.listen(parts.zoomOut, 'click', () => parts.map.zoomOut());
    this.listen(parts.fit, 'click', () => parts.map.fit());
    this.#bindsList();
    this.#bindsKeys();
    signal.addEventListener('abort', () => (this.#asked.abort(), this.#moving.abort()));
    this.#ask();
  }

  /** Asks for the wanted assets, now and again; the address says which, and where the map looks. */
  #ask() {
    this.#asked.abort();
    this.#asked = new AbortController();
    const { signal } = this.#asked;
    const wanted = new URLSearchParams(this.#chosen());
    const ask = async () => {
      this.#show(await get(`/api/map?${wanted}`, signal));
      showFault(this.parts.fault, null);
      return this.answer.pending > 0 ? POLL_PENDING_S : POLL_S;
    };
    return poll(ask, signal, (error) => showFault(this.parts.fault, error));
  }

  #chosen() {
    return FILTERS.filter((name) => this.#filters[name] !== '').map((name) => [name, this.#filters[name]]);
  }

  #filter() {
    for (const name of FILTERS) this.#filters[name] = this.parts[name].value;
    this.#next = 'all';
    this.#keepInAddress();
    this.#ask();
  }

  #show(answer) {
    const { parts } = this;
    const { map } = parts;
    if (!this.answer)
      map.setTiles(answer.tiles, (isFaulty) => {
        parts.tilesFault.hidden = !isFaulty;
      });
    this.answer = answer;
    this.#places = placesOf(answer.assets);
    const isEmpty = answer.placed === 0;
    const isAll = this.#chosen().length === 0;
    parts.area.hidden = isEmpty;
    parts.empty.hidden = !isEmpty || !isAll;
    parts.nothing.hidden = !isEmpty || isAll;
    this.#offerProjects(answer.projects);
    render(parts.pending, pendingNote(answer.pending));
    render(parts.left, leftMarkup(answer));
    setText(parts.attribution, answer.tiles ? (answer.attribution ?? '') : t('map.plan'));
    if (isEmpty) return;
    map.show(this.#places);
    if (this.#next === 'all') map.fit();
    else if (this.#next) map.look = this.#next;
    this.#next = null;
    this.#settle();
  }

  #offerProjects(projects) {
    const { project } = this.#filters;
    const names = projects.includes(project) || project === '' ? projects : [project, ...projects];
    if (names.join('\n') === this.#offered) return; // a list that is open stays open
    this.#offered = names.join('\n');
    render(
      this.parts.project,
      html`<option value="">${t('search.any')}</option>${names.map((name) => html`<option value="${name}">${name}</option>`)}`,
    );
    this.parts.project.value = project;
  }

  #pick(mark) {
    if (mark === null) this.#card.close();
    else if (mark.cluster.places.length === 1 || !this.parts.map.open(mark.cluster)) this.#card.keep(mark);
  }

  /** Lists what is in sight and keeps the view in the address, once the map has come to rest. */
  async #settle() {
    this.#moving.abort();
    this.#moving = new AbortController();
    const { signal } = this.#moving;
    await pause(SETTLE_S, signal);
    if (signal.aborted) return;
    const { map } = this.parts;
    const [lat, lon, zoom] = map.look;
    const at = [lat.toFixed(LAT_LON_DECIMALS), lon.toFixed(LAT_LON_DECIMALS), zoom.toFixed(ZOOM_DECIMALS)].join();
    this.#keepInAddress(['at', at]);
    this.#list();
  }

  #keepInAddress(...looks) {
    const query = new URLSearchParams([...this.#chosen(), ...looks]);
    history.replaceState(null, '', `${location.pathname}${query.size ? `?${query}` : ''}`);
  }

  #list() {
    const { parts } = this;
    const seen = this.#places.filter((place) => parts.map.sees(place));
    const rest = seen.length - MOST_LISTED;
    setText(parts.seen, t('map.seen', { n: seen.length, count: count(seen.length), all: count(this.#places.length) }));
    patchList(parts.list, seen.slice(0, MOST_LISTED), ({ asset }) => asset.asset, newRow, fillRow);
    setText(parts.more, rest > 0 ? t('map.more', { n: rest, count: count(rest) }) : '');
  }

  /** The row under the pointer or with the focus is highlighted on the map. */
  #bindsList() {
    const { list, map } = this.parts;
    const nameAt = (target) => target.closest('[data-key]')?.dataset.key ?? null;
    for (const type of ['focusin', 'pointerover']) {
      this.listen(list, type, ({ target }) => map.highlight(nameAt(target)));
    }
    for (const type of ['focusout', 'pointerleave']) this.listen(list, type, () => map.highlight(null));
    this.listen(list, 'click', ({ target }) => {
      if (!target.closest('button')) return;
      const name = nameAt(target);
      map.fit(this.#places.filter(({ asset }) => asset.asset === name));
    });
  }

  #bindsKeys() {
    const { map } = this.parts;
    const bindings = [
      { keys: ['+', '='], shown: ['+'], label: t('map.zoom_in'), run: () => map.zoomIn() },
      { keys: ['-'], label: t('map.zoom_out'), run: () => map.zoomOut() },
      { keys: ['f'], label: t('map.fit'), run: () => map.fit() },
    ];
    const arrows = { keys: ['ArrowLeft'], shown: ['←', '→', '↑', '↓'], label: t('map.move') };
    const help = () => showKeys([{ title: t('archive.map'), bindings: [...bindings, arrows] }], { hasStage: false });
    bindKeys(document, [...bindings, { keys: ['?'], label: t('keys.list'), run: help }], this.signal);
  }
}

/** Returns [latitude, longitude, zoom] of the address, or null. */
function lookOf(text) {
  const numbers = text?.split(',').map(Number) ?? [];
  return numbers.length === 3 && numbers.every(Number.isFinite) ? numbers : null;
}

const contentMarkup = () => html`<form class="map-filters flow at-bottom below-3" data-part="form">
    <div class="field"><label for="map-project">${t('archive.project')}</label><select class="input" id="map-project" data-part="project"></select></div>
    <div class="field"><label for="map-severity">${t('map.severity')}</label>
      <select class="input" id="map-severity" data-part="severity_from"><option value="">${t('search.any')}</option>
        ${GRADES.map((grade) => html`<option value="${grade}">${grade} · ${severityWord(grade)}</option>`)}</select></div>
    <div class="map-legend grow small"><p class="dim">${t('map.legend')}</p>
      <ul class="flow gap-row">${[...GRADES, null].map((grade) => html`<li class="inline-row gap-1">${severityMark(grade)}<span aria-hidden="true">${severityWord(grade)}</span></li>`)}</ul></div>
  </form>
  <div data-part="pending"></div>
  <div data-part="left"></div>
  <section class="panel map-empty stack gap-3" data-part="empty" hidden><h2>${t('map.empty')}</h2>
    <p>${pieces('map.empty_text', { latitude: html`<b>${wordFor('header', 'start_lat')}</b>`, longitude: html`<b>${wordFor('header', 'start_lon')}</b>` })}</p>
    <p><a class="button" href="/assets/register">${t('map.register')}</a></p></section>
  <p class="panel row gap-3 wrap pad-4" data-part="nothing" hidden>${t('map.nothing')}</p>
  <div class="map-area one-if-narrow stack gap-4" data-part="area">
    <div class="map panel">
      <map-canvas data-part="map"></map-canvas>
      <div class="map__buttons stack gap-1">
        <button type="button" class="button button--icon" title="${withKey(t('map.zoom_in'), '+')}" aria-label="${t('map.zoom_in')}" data-part="zoomIn">${icon('plus')}</button>
        <button type="button" class="button button--icon" title="${withKey(t('map.zoom_out'), '-')}" aria-label="${t('map.zoom_out')}" data-part="zoomOut">${icon('minus')}</button>
        <button type="button" class="button button--icon" title="${withKey(t('map.fit'), 'F')}" aria-label="${t('map.fit')}" data-part="fit">${icon('large')}</button>
      </div>
      <p class="map__note small" role="status" data-part="tilesFault" hidden>${t('map.tiles_fault')}</p>
      <p class="map__attribution small unless-empty" data-part="attribution"></p>
      <div class="map-card panel pad-row small" role="group" aria-label="${t('map.card')}" data-part="card" hidden></div>
    </div>
    <section class="map-list stack packed" aria-label="${t('map.list')}"><p class="dim number" role="status" data-part="seen">${t('page.loading')}</p>
      <ul data-part="list"></ul><p class="dim number" data-part="more"></p></section>
  </div>`;

/** Assets that the map does not show, and why. */
const leftMarkup = ({ assets, placed, unplaced }) => html`
  ${placed > assets.length && html`<p class="message">${icon('info')}<span>${t('map.too_many', { count: count(assets.length), all: count(placed) })}</span></p>`}
  ${placed > 0 && unplaced > 0 && html`<p class="below-3 small dim">${t('map.unplaced', { n: unplaced, count: count(unplaced) })} <a href="/assets/register">${t('map.register')}</a></p>`}`;

const newRow = () => {
  const row = document.createElement('li');
  row.className = 'map-list__row row gap-0 line-below';
  return row;
};

function fillRow(row, { asset }) {
  const facts = [asset.project, gradeWord(asset), asset.last_at && day(asset.last_at)].filter(Boolean).join(' · ');
  renderNew(
    row,
    html`<a class="row grow shrinks plain" href="${assetPath(asset.asset)}">${severityMark(asset.worst_severity)}<span><b class="breaks">${asset.asset}</b><small class="help">${facts}</small></span></a>
      <button type="button" class="button button--quiet button--small button--icon" title="${t('map.show', { asset: asset.asset })}" aria-label="${t('map.show', { asset: asset.asset })}">${icon('map')}</button>`,
  );
}

customElements.define('map-page', MapPage);
