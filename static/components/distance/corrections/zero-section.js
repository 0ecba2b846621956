/** The zero of the distance: the frame as evidence, and how far the camera was past the zero. */

import { ownKey } from '../../../core/page/keys.js';
import { html, render } from '../../../core/page/html.js';
import { hasFilm } from '../../../core/survey/inspection.js';
import { Component } from '../../../core/page/store.js';
import { lengthUnit, signed, timecode, toShown } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { isAny, metresField, readMetres, writeMetres } from './fields.js';

export class ZeroSection extends Component {
  mount() {
    this.page = this.closest('inspection-page');
    this.desk = this.page.desk;
    /** @type {Parts<'corrections/zero-section'>} */
    this.parts = render(
      this,
      html`<h3>${t('corrections.zero')}</h3>
        <div class="zero">
          <button class="zero__evidence framed--strong plain" data-part="evidence" hidden>
            <img data-part="picture" alt="" width="160" height="120" />
            <span class="number" data-part="caption"></span>
          </button>
          <p class="zero__none pad-3 small dim" data-part="none">${t('corrections.zero_none')}</p>
          <div class="stack gap-3">
            <div class="fix__buttons row wrap">
              <button class="button button--small" data-part="here"><kbd>${ownKey('Z')}</kbd>${t('corrections.zero_here')}</button>
              <button class="button button--small button--quiet" data-part="clear" hidden>${t('corrections.clear')}</button>
            </div>
            ${metresField({ part: 'offset', id: 'zero-offset', label: t('corrections.offset') })}
          </div>
          <figure class="zero__sketch stack whole-row" data-part="sketch"></figure>
        </div>`,
    );
    const { parts, desk } = this;
    this.listen(parts.here, 'click', () => this.page.setZero());
    this.listen(parts.clear, 'click', () => desk.corrections.edit({ zero: null }));
    this.listen(parts.evidence, 'click', () => desk.seek(desk.corrections.draft.value.zero.frame));
    this.listen(parts.offset, 'change', () => this.#offset());
    this.listen(desk.corrections.draft, 'change', () => this.#show());
    this.listen(desk.track, 'change', () => this.#caption());
    this.#show();
  }

  #offset() {
    const offset = readMetres(this.parts, 'offset', isAny, t('corrections.fault_length'));
    const { zero } = this.desk.corrections.draft.value;
    if (offset === undefined) return;
    // Without a stated frame the zero is at the first one.
    this.desk.corrections.edit({ zero: { frame: zero?.frame ?? 0, offset_m: offset ?? 0 } });
  }

  #show() {
    const { parts, desk } = this;
    const { zero } = desk.corrections.draft.value;
    parts.evidence.hidden = parts.clear.hidden = zero === null;
    parts.none.hidden = zero !== null;
    writeMetres(parts.offset, zero?.offset_m ?? 0);
    render(parts.sketch, sketch(zero?.offset_m ?? 0));
    if (zero === null) return;
    parts.picture.hidden = !hasFilm(desk.inspection.value);
    if (parts.picture.hidden) {
      this.#caption();
      return;
    }
    const source = `/api/inspections/${desk.inspection.id}/frames/${zero.frame}.jpg`;
    if (parts.picture.getAttribute('src') !== source) parts.picture.src = source;
    this.#caption();
  }

  #caption() {
    const { zero } = this.desk.corrections.draft.value;
    if (!zero) return;
    const { frame } = zero;
    const row = this.desk.track.row(frame);
    this.parts.caption.textContent = row
      ? t('corrections.evidence', { frame, time: timecode(row.time_s) })
      : t('corrections.frame', { frame });
    this.parts.evidence.title = t('corrections.go_to_frame', { frame });
  }
}

/** Draws the culvert from the side: the zero at its headwall, the camera, and the offset between them. */
function sketch(offsetM) {
  const [wall, reach] = [78, 64];
  const camera = offsetM === 0 ? wall : wall + Math.sign(offsetM) * reach;
  const shown = `${offsetM > 0 ? '+' : ''}${signed(toShown(offsetM), 2)} ${lengthUnit}`;
  return html`<svg class="offset-sketch full" viewBox="0 0 240 112" role="img" aria-label="${t('corrections.sketch', { offset: shown })}">
      <path stroke="var(--line-strong)" stroke-dasharray="3 4" d="M0 22h${wall}M0 92h${wall}" />
      <path stroke-width="3" d="M${wall} 4v18h162M${wall} 108V92h162" />
      <path stroke="var(--text)" stroke-dasharray="5 3" d="M${wall} 22v70" />
      <text class="offset-sketch__text" x="${wall + 5}" y="16">0</text>
      <path fill="var(--accent-wash)" stroke="var(--accent)" d="M${camera - 11} 62h22v16h-22zM${camera + 11} 66l7 -4v16l-7 -4" />
      <path stroke="var(--accent)" stroke-linecap="round" stroke-width="5" d="M${camera - 6} 78v10M${camera + 6} 78v10" />
      ${offsetM !== 0 && html`<path stroke="var(--text)" d="M${wall} 48H${camera}m${-6 * Math.sign(offsetM)} -4l${6 * Math.sign(offsetM)} 4l${-6 * Math.sign(offsetM)} 4" />`}
      <text class="offset-sketch__text offset-sketch__text--strong" x="${(wall + camera) / 2}" y="40" text-anchor="middle">${shown}</text>
      <path d="M178 100h44m-7 -4l7 4l-7 4" />
    </svg>
    <figcaption class="help">${t('corrections.offset_help')}</figcaption>`;
}

customElements.define('zero-section', ZeroSection);
