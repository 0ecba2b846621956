/** The assets that were inspected or are registered; with ?asset=NAME one of them and its history. */

import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { framedPage, exportButton } from '../../shared/page-frame/page-frame.js';
import { icon } from '../../shared/icon/icon.js';
import './asset-history.js';
import { assetTableMarkup, fillAssetTable } from './asset-table.js';

export class AssetsPage extends Component {
  mount() {
    const asset = new URLSearchParams(location.search).get('asset');
    if (asset === null) this.#showAll();
    else this.#showOne(asset);
  }

  #showAll() {
    /** @type {Parts<'assets-page/assets-page'>} */
    this.parts = render(
      this,
      framedPage({ title: t('archive.assets'), ways: exportButton(), content: assetTableMarkup() }),
    );
    fillAssetTable(this, false);
  }

  #showOne(asset) {
    /** @type {Parts<'assets-page/assets-page'>} */
    this.parts = render(
      this,
      framedPage({
        title: asset,
        ways: html`<a class="button" href="/assets">${icon('back')}${t('archive.assets')}</a><button class="button" data-part="edit" data-needs="operator">${icon('edit')}${t('assets.edit')}</button><span data-part="compare"></span>
          <a class="button button--primary" href="/new?${new URLSearchParams({ asset })}" data-needs="operator">${icon('plus')}${t('work.start')}</a>`,
        content: html`<asset-history data-part="history"></asset-history>`,
      }),
    );
    this.parts.history.fill(asset, this.parts);
  }
}

customElements.define('assets-page', AssetsPage);
