/**
 * What a rig makes of its film: a picture with the wall's lines on it, and in words how the rig will measure.
 *
 * Set `source` to the address of a picture or null, and `rig` to a rig without faults or null.
 * Event `turn`: turn the camera by the degrees of its detail.
 */

import { post, refusalIn } from '../../../core/server/api.js';
import { USUAL_LIMIT_M_PER_MIN } from '../../../core/survey/health.js';
import { html, render, setText } from '../../../core/page/html.js';
import { newest } from '../../../core/server/newest.js';
import { Component } from '../../../core/page/store.js';
import { speed } from '../../../core/wall/units.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { message } from '../../shared/message/message.js';

/** The judgement takes the server some tenths of a second, so it waits for a rest in the typing. */
const REST_MS = 400;
/** Height of a label, as a share of the picture's width. */
const LABELS_ACROSS = 36;
const TURNS = [
  [-90, t('rigview.turn_back')],
  [90, t('rigview.turn_90')],
  [180, t('rigview.turn_180')],
];

export class RigPicture extends Component {
  #rig = null;
  #resting = 0;
  #rule = newest((rig) => this.#askRuling(rig));
  #judge = newest((rig) => this.#askAdvice(rig));

  mount() {
    /** @type {Parts<'rig-form/rig-picture'>} */
    this.parts = render(
      this,
      html`<figure class="rig-picture" data-part="figure" hidden>
          <div class="stage-of-picture">
            <img alt="${t('rigview.picture')}" data-part="picture" />
            <svg class="rig-picture__lines covers" preserveAspectRatio="none" aria-hidden="true" data-part="lines"></svg>
          </div>
          <figcaption class="help" data-part="caption">${t('rigview.help')}</figcaption>
          <div class="rig-picture__turns flow" role="group" aria-label="${t('rigview.turns')}">
            ${TURNS.map(
              ([degrees, text]) => html`<button type="button" class="button button--small" data-turn="${degrees}">
              ${icon('retry')}${text}</button>`,
            )}
          </div>
        </figure>
        <p class="help" data-part="wait" hidden>${t('rigview.none')}</p>
        <div role="status" data-part="said"></div>`,
    );
    const { figure, picture } = this.parts;
    this.listen(picture, 'load', () => (figure.hidden = false));
    this.listen(picture, 'error', () => (figure.hidden = true));
    for (const button of this.querySelectorAll('[data-turn]')) {
      this.listen(button, 'click', () => {
        this.dispatchEvent(new CustomEvent('turn', { detail: Number(button.dataset.turn) }));
      });
    }
  }

  disconnectedCallback() {
    super.disconnectedCallback();
    clearTimeout(this.#resting);
  }

  set source(address) {
    const { figure, picture, wait } = this.parts;
    wait.hidden = address !== null;
    if (address === picture.getAttribute('src')) return;
    figure.hidden = true;
    if (address === null) picture.removeAttribute('src');
    else picture.src = address;
  }

  set rig(rig) {
    if (JSON.stringify(rig) === JSON.stringify(this.#rig)) return;
    this.#rig = rig;
    clearTimeout(this.#resting);
    if (rig === null) {
      this.#clear();
      return;
    }
    this.#rule(rig);
    this.#resting = setTimeout(() => this.#judge(rig), REST_MS);
  }

  #clear() {
    render(this.parts.lines, html``);
    render(this.parts.said, html``);
  }

  #askRuling(rig) {
    return this.#ask('/api/rig/ruling', rig, (ruling) => this.#draw(rig.camera, ruling));
  }

  #askAdvice(rig) {
    return this.#ask('/api/rig/advice', rig, (advice) => render(this.parts.said, words(advice)));
  }

  /** An answer about a rig that has changed meanwhile is dropped: the next one is on its way. */
  async #ask(address, rig, show) {
    try {
      const answer = await post(address, { rig }, this.signal);
      if (rig === this.#rig) show(answer);
    } catch (error) {
      if (!refusalIn(error)) return;
      if (rig !== this.#rig) return;
      this.#clear();
      render(this.parts.said, message('error', errorText(error)));
    }
  }

  #draw({ width, height }, { step_mm: step, across, along }) {
    const { lines, caption } = this.parts;
    const isIn = (pixel) => pixel && pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < width && pixel[1] < height;
    const isRound = this.#rig.pipe.shape === 'circular';
    const mm = ({ at }) => t('rigview.mm', { mm: String(at).replace('-', '−') });
    const hour = ({ at }) => t('rigview.hour', { hour: at });
    const way = along.find(({ at }) => at === (isRound ? 6 : 0))?.uv.filter(isIn) ?? [];
    const size = width / LABELS_ACROSS;
    const labels = apart(
      [
        ...across.map((line) => ({ at: pointOf(line.uv.filter(isIn), 0.25), text: mm(line) })),
        ...along.map((line) => ({ at: pointOf(line.uv.filter(isIn), 0.7), text: isRound ? hour(line) : mm(line) })),
      ],
      size,
      width,
    );
    lines.setAttribute('viewBox', `-0.5 -0.5 ${width} ${height}`);
    render(
      lines,
      html`<svg>
        <path class="rig-picture__line" d="${across.map(({ uv }) => pathOf(uv)).join('')}" />
        <path class="rig-picture__line rig-picture__line--along" d="${along.map(({ uv }) => pathOf(uv)).join('')}" />
        ${
          way.length > 1 &&
          html`<path class="rig-picture__way" d="${pathOf(way)}" />
          <path class="rig-picture__head" d="${arrowHead(way, size)}" />`
        }
        ${labels.map(({ at: [u, v], text }) => html`<text x="${u}" y="${v}" font-size="${size}">${text}</text>`)}
      </svg>`,
    );
    setText(caption, t('rigview.help_step', { step }));
  }
}

/** Returns the path of a line of pixels; it is interrupted where the lens sees no wall. */
const pathOf = (line) =>
  line
    .map((pixel, i) => pixel && `${i && line[i - 1] ? 'L' : 'M'}${pixel.join(' ')}`)
    .filter(Boolean)
    .join('');

/** Returns a triangle at the end of a line. */
function arrowHead(line, size) {
  const [[u0, v0], [u, v]] = line.slice(-2);
  const long = Math.hypot(u - u0, v - v0) || 1;
  const [du, dv] = [((u - u0) / long) * size, ((v - v0) / long) * size];
  const corner = (side) => `${u - du - (side * dv) / 2} ${v - dv + (side * du) / 2}`;
  return `M${u} ${v}L${corner(1)}L${corner(-1)}Z`;
}

/** Returns the pixel at a part of what is seen of a line; undefined if nothing is. */
const pointOf = (seen, part) => seen[Math.floor(part * (seen.length - 1))];

/** Returns the labels that lie within the picture and on no earlier one. */
function apart(labels, size, width) {
  const half = 2.2 * size; // of the longest label
  const placed = [];
  for (const { at, text } of labels) {
    const isFree =
      at && placed.every((other) => Math.abs(other.at[0] - at[0]) > 2 * half || Math.abs(other.at[1] - at[1]) > size);
    if (isFree && at[0] > half && at[0] < width - half && at[1] > size) placed.push({ at, text });
  }
  return placed;
}

const perMinute = (mmPerS) => speed((mmPerS * 60) / 1000);

/** Sentences on what speaks against a rig, by the names of the server. */
const findingsOf = (figures) => ({
  forward: t('rigview.finding_forward'),
  fast: t('rigview.finding_fast'),
  hurried: t('rigview.finding_hurried'),
  near: t('rigview.finding_near'),
  coarse: t('rigview.finding_coarse', figures),
  oblique: t('rigview.finding_oblique', figures),
  corrugated: t('rigview.finding_corrugated'),
});

/** Returns the judgement of a rig as a sentence and what to look after. */
function words(advice) {
  const figures = {
    seen: Math.round(advice.seen_mm),
    good: perMinute(advice.good_speed_mm_s),
    limit: perMinute(advice.limit_speed_mm_s),
    usual: speed(USUAL_LIMIT_M_PER_MIN),
    percent: Math.abs(advice.height_error_percent).toFixed(2),
    pixel: advice.mm_per_px.toFixed(2),
    share: Math.round(100 * advice.measured_share),
  };
  const findings = findingsOf(figures);
  const isUnfit = advice.verdict === 'not fit';
  return html`<p class="message${isUnfit && ' message--error'}">${icon(isUnfit ? 'alert' : 'info')}
      <span>${t('rigview.sees', figures)} ${Number(figures.percent) > 0 && t('rigview.height', figures)}</span></p>
    ${
      advice.findings.length > 0 &&
      html`<ul class="rig-picture__findings">
      ${advice.findings.map((name) => html`<li>${findings[name]}</li>`)}</ul>`
    }`;
}

customElements.define('rig-picture', RigPicture);
