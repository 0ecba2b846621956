/** What the map says of the assets of a mark, beside it. */

import { html, render } from '../../../core/page/html.js';
import { count, day } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { assetPath } from '../assets-page/asset-table.js';
import { severityMark, severityWord } from '../../shared/severity-mark/severity-mark.js';

const MOST_NAMES = 8;
/** So near that the pointer comes from the mark to the card without leaving both. */
const GAP_PX = 2;

/** The grade of an asset in words: 'plan repair', 'not rated', 'never inspected'. */
export const gradeWord = ({ worst_severity: worst, inspections }) =>
  inspections === 0 ? t('map.never') : severityWord(worst);

/**
 * A card that follows the pointer, until a click keeps it: then it stays until the map moves, another place is
 * clicked, or Escape.
 */
export class Card {
  #element;
  #isKept = false;

  /** @param {HTMLElement} element within the map, as large as its content @param {AbortSignal} signal */
  constructor(element, signal) {
    this.#element = element;
    element.addEventListener('pointerleave', () => this.point(null), { signal });
    element.ownerDocument.addEventListener('keydown', ({ key }) => key === 'Escape' && this.close(), { signal });
  }

  /** Shows the card of the mark under the pointer, unless one is kept. */
  point(mark) {
    if (this.#isKept || (mark === null && this.#element.matches(':hover'))) return;
    if (mark) this.#show(mark);
    else this.close();
  }

  /** Keeps the card of a mark. */
  keep(mark) {
    this.#isKept = true;
    this.#show(mark);
  }

  close() {
    this.#isKept = false;
    this.#element.hidden = true;
  }

  #show({ cluster, x, y, reach }) {
    const { places } = cluster;
    render(this.#element, places.length === 1 ? assetMarkup(places[0].asset) : clusterMarkup(places, this.#isKept));
    this.#element.hidden = false;
    const { clientWidth, clientHeight } = this.#element.parentElement;
    const { offsetWidth: width, offsetHeight: height } = this.#element;
    const isLeft = x + reach + GAP_PX + width > clientWidth && x > clientWidth / 2;
    const left = isLeft ? x - reach - GAP_PX - width : x + reach + GAP_PX;
    const top = Math.min(Math.max(y - height / 2, 0), clientHeight - height);
    this.#element.style.left = `${Math.max(left, 0)}px`;
    this.#element.style.top = `${top}px`;
  }
}

function assetMarkup(asset) {
  return html`<a class="map-card__name strong breaks" href="${assetPath(asset.asset)}">${asset.asset}</a>
  ${asset.project && html`<p class="dim">${asset.project}</p>`}
  <p class="map-card__grade">${severityMark(asset.worst_severity)}<b>${asset.worst_severity ?? ''}</b> ${gradeWord(asset)}</p>
  ${
    asset.last_at &&
    html`<p class="number">${t('map.surveyed', { day: day(asset.last_at) })}</p>
    <p class="number">${t('map.inspections', { n: asset.inspections, count: count(asset.inspections) })}</p>`
  }`;
}

/** A cluster that is kept is one that no zoom takes apart: its assets are named. */
function clusterMarkup(places, isKept) {
  return html`<b>${t('map.assets', { n: places.length, count: count(places.length) })}</b>
  ${
    isKept
      ? html`<p class="dim">${t('map.one_place')}</p><ul class="map-card__names">${places
          .slice(0, MOST_NAMES)
          .map(
            ({ asset }) =>
              html`<li><a href="${assetPath(asset.asset)}">${severityMark(asset.worst_severity)}${asset.asset}</a></li>`,
          )}</ul>${places.length > MOST_NAMES && html`<p class="dim">${t('map.more', { n: places.length - MOST_NAMES, count: count(places.length - MOST_NAMES) })}</p>`}`
      : html`<p class="map-card__grade">${severityMark(places[0].asset.worst_severity)} ${t('map.worst', { word: gradeWord(places[0].asset) })}</p>
      <p class="dim">${t('map.come_closer')}</p>`
  }`;
}
