/** Where one asset lies: a small map that does not move, and the coordinates as text. */

import { html, render } from '../../../core/page/html.js';
import { fitted, toDegrees } from '../../../core/wall/mercator.js';
import { onThemeChange, sharpContext, typeScale } from '../../../core/page/screen.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { paintBackground, paintLines, paintMarks, paintNorth, paintMapScale } from '../map-page/paint.js';
import { clustersOf, placesOf } from '../map-page/places.js';
import { Tiles } from '../map-page/tiles.js';
import { icon } from '../../shared/icon/icon.js';

const MARGIN_PX = 36;
/** Of degrees: 0.1 m on the ground. */
const DECIMALS = 6;

/** Give it the answer of `/api/map?asset=` with `show`; it can be asked again after a change. */
export class AssetMap extends Component {
  #places = [];
  #tiles = null;

  mount() {
    onThemeChange(() => this.repaint(), this.signal);
    const resized = new ResizeObserver(() => this.repaint());
    resized.observe(this);
    this.signal.addEventListener('abort', () => resized.disconnect());
  }

  /** @param {{assets: object[], tiles: string|null, attribution: string|null}} answer of `/api/map?asset=` */
  show({ assets, tiles, attribution }) {
    this.#places = placesOf(assets.slice(0, 1));
    this.#tiles =
      tiles &&
      new Tiles(
        tiles,
        () => this.repaint(),
        () => {},
      );
    const [place] = this.#places;
    /** @type {Parts<'asset-map/asset-map'>} */
    this.parts = render(
      this,
      place ? markup(place, tiles && attribution) : html`<p class="panel row gap-3 wrap pad-4">${t('map.unknown')}</p>`,
    );
    this.repaint();
  }

  paint() {
    const { ground } = this.parts ?? {};
    if (!ground?.clientWidth) return;
    const scale = typeScale();
    const size = { width: ground.clientWidth / scale, height: ground.clientHeight / scale };
    const view = fitted(this.#places[0].points, size, MARGIN_PX);
    const sheet = { context: sharpContext(ground, scale), styles: getComputedStyle(this), view, size };
    paintBackground(sheet, this.#tiles);
    paintLines(sheet, this.#places);
    paintMarks(sheet, clustersOf(this.#places, view.zoom));
    paintMapScale(sheet);
    paintNorth(sheet);
    const [lon, lat] = toDegrees([view.x, view.y]);
    this.parts.open.href = `/assets/map?${new URLSearchParams({ at: [lat, lon, view.zoom].join() })}`;
  }
}

function markup({ asset }, attribution) {
  const [start, end] = [asset.line[0], asset.line.at(-1)];
  return html`<figure class="panel">
    <div class="asset-map__sheet"><canvas role="img" aria-label="${t('map.of', { asset: asset.asset })}" data-part="ground"></canvas>
      <span class="map__attribution small unless-empty">${attribution}</span></div>
    <figcaption class="asset-map__facts row wrap apart pad-row small"><span class="number">${t('map.start')} ${placeText(start)}</span>
      ${asset.line.length > 1 && html`<span class="number">${t('map.end')} ${placeText(end)}</span>`}
      <a class="button button--small" data-part="open">${icon('map')}${t('map.open')}</a></figcaption></figure>`;
}

/** '3.139100, 101.686900': latitude and longitude, as maps and field devices take them. */
const placeText = ([lon, lat]) => `${lat.toFixed(DECIMALS)}, ${lon.toFixed(DECIMALS)}`;

customElements.define('asset-map', AssetMap);
