/** The 3D culvert in its frame: its camera, its cut, measuring by clicks, and full screen. */

import { html, render, setText } from '../../../core/page/html.js';
import { pageId } from '../../../core/page/new-id.js';
import { recall, remember } from '../../../core/page/remembered.js';
import { may } from '../../../core/page/rights.js';
import { Component } from '../../../core/page/store.js';
import { lengthUnit } from '../../../core/wall/units.js';
import { language, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { windowButton } from '../../distance/strip/window-button.js';

const REMEMBERED = 'chainage.camera';
const CAMERAS = [
  ['follow', t('viewer.follow'), t('viewer.follow_help')],
  ['overview', t('viewer.overview'), t('viewer.overview_help')],
  ['inside', t('viewer.inside'), t('viewer.inside_help')],
];

const CUTS = [
  ['none', t('viewer.cut_none')],
  ['top', t('viewer.cut_top')],
  ['side', t('viewer.cut_side')],
];

export class ViewerPanel extends Component {
  /** Keys pressed in the 3D view, as `keydown` events. */
  keys = new EventTarget();
  /** @type {string[]} names of keys whose default action is prevented there */
  bound = [];

  #mode;
  #isMeasuring = false;
  /** Whether software renders the view, which is then drawn seldom while a camera runs. */
  #isSlow = false;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', t('viewer.title'));
    const isPipe = this.desk.inspection.value.rig?.pipe.shape !== 'flat';
    const gl = document.createElement('canvas').getContext('webgl2');
    this.#isSlow = gl !== null && isSlow(gl);
    /** @type {Parts<'views/viewer-panel'>} */
    this.parts = render(
      this,
      html`<div class="panel-head viewer__head">
          <h2><span class="visually-hidden">${t('viewer.title')}</span> <small class="dim" data-part="late"></small></h2>
          <div class="viewer__cameras flow gap-1" role="group" aria-label="${t('viewer.cameras')}">
            ${CAMERAS.map(
              ([mode, label, title]) => html`<button class="button button--small" data-mode="${mode}"
              aria-pressed="false" title="${title}">${label}</button>`,
            )}
          </div>
          <div class="flow gap-1" role="group" aria-label="${t('viewer.tools')}">
            <select class="input viewer__cut small" aria-label="${t('viewer.cut')}" title="${t('viewer.cut_help')}" data-part="cut">
              ${CUTS.map(([half, label]) => html`<option value="${half}">${label}</option>`)}
            </select>
            <button class="button button--small button--icon" aria-pressed="false" aria-label="${t('viewer.measure')}"
              title="${t('viewer.measure_help')}" data-part="measure">${icon('ruler')}</button>
            <button class="button button--small button--icon" data-part="window"></button>
            <button class="button button--small button--icon" data-part="large" aria-pressed="false"
              aria-label="${t('viewer.large')}" title="${t('viewer.large')}">${icon('large')}</button>
          </div>
        </div>
        <div class="viewer__stage grow" data-part="stage"></div>`,
    );
    for (const button of this.querySelectorAll('[data-mode]')) {
      this.listen(button, 'click', () => this.#choose(button.dataset.mode));
    }
    this.listen(this.parts.large, 'click', () => this.desk.large.toggle('viewer'));
    this.listen(this.desk.large, 'change', () => this.#pressed(this.parts.large, this.desk.large.value === 'viewer'));
    this.#showStage(gl !== null);
    windowButton(this.parts.window, this.desk, 'viewer', this.signal);
    if (this.desk.windows) this.listen(this.desk.windows, 'change', () => this.#showStage(gl !== null));
    if (gl) {
      this.listen(this.desk.inspection, 'change', () => {
        this.#showStage(true);
        this.#briefFrame();
        this.#showLate();
      });
      addEventListener('message', (event) => this.#hear(event), { signal: this.signal });
    }
    this.listen(this.desk.live, 'state', () => this.#send());
    // The new tag is edited here: the keyboard focus returns to the page.
    this.listen(this.desk.live, 'wall_click', () => this.parts.frame?.blur());
    this.parts.late.hidden = !this.#isLate;
    this.parts.cut.hidden = !isPipe;
    this.parts.measure.hidden = !may('operator');
    this.listen(this.parts.cut, 'change', () => this.#send());
    this.listen(this.parts.measure, 'click', () => this.#measure(!this.#isMeasuring));
    this.#choose(recall(REMEMBERED, 'follow'));
  }

  /** Shows the 3D view, or why it is not here: a view in a window of its own is drawn only there. */
  #showStage(hasGl) {
    const isAway = Boolean(this.desk.windows?.has('viewer'));
    const rests = this.desk.inspection.value.live?.shed.includes('view') ?? false;
    const state = `${isAway} ${rests}`;
    if (this.parts.stage.dataset.state === state) return; // another part has moved: the view goes on
    this.parts.stage.dataset.state = state;
    this.parts.cut.disabled = this.parts.measure.disabled = this.parts.large.disabled = isAway;
    for (const button of this.querySelectorAll('[data-mode]')) button.disabled = isAway;
    const size = this.#isLate ? `&fixedDpr=${devicePixelRatio / 2}` : '';
    const { frame } = render(
      this.parts.stage,
      hasGl && !isAway && !rests
        ? html`<iframe src="/viewer/${this.desk.inspection.id}/?page=${pageId}${size}" sandbox="allow-scripts"
          title="${t('viewer.frame')}" data-part="frame"></iframe>`
        : html`<p class="message">${whyAbsent({ isAway, rests })}</p>`,
    );
    this.parts.frame = frame;
    frame?.addEventListener('load', () => this.#briefFrame(), { signal: this.signal });
  }

  get #isLive() {
    return this.desk.inspection.value.live !== null;
  }

  get #isLate() {
    return this.#isSlow && this.#isLive;
  }

  /** The view is seconds late: the page says so, and no second distance contradicts the read-out. */
  #showLate() {
    if (this.parts.late.hidden !== this.#isLate) return;
    this.parts.late.hidden = !this.#isLate;
    this.#send();
  }

  /** How late, and why: one picture takes the device so long that the next one waits. */
  #showHowLate({ tookMs, everyMs }) {
    if (!(tookMs >= 0 && everyMs >= 0)) return;
    const { late } = this.parts;
    const seconds = (ms) => (ms / 1000).toFixed(1);
    setText(late, t('viewer.late', { s: seconds(everyMs + tookMs) }));
    late.title = t('viewer.late_help', { took: seconds(tookMs), every: seconds(everyMs) });
  }

  /** While a camera runs its picture comes first. */
  #briefFrame() {
    const keys = this.bound.map((name) => name.replace('Shift+', ''));
    this.parts.frame?.contentWindow.postMessage({ isLimited: this.#isLive, keys }, '*');
  }

  /** Accepts only the pointer and key presses of a person: the client in the frame is not ours. */
  #hear({ source, data }) {
    const { frame } = this.parts;
    if (!frame || source !== frame.contentWindow) return;
    if ('pointer' in data) {
      this.desk.live.send({ type: 'point', at: placeOf(data.pointer) });
      return;
    }
    if ('everyMs' in data) {
      this.#showHowLate(data);
      return;
    }
    if (document.activeElement !== frame) return;
    if (data.key === 'Escape' && this.#isMeasuring) {
      this.#measure(false);
      return;
    }
    if (data.key !== 'Escape' && !navigator.userActivation.isActive) return;
    this.keys.dispatchEvent(new KeyboardEvent('keydown', data));
  }

  #choose(mode) {
    this.#mode = mode;
    remember(REMEMBERED, mode);
    this.#send();
    for (const button of this.querySelectorAll('[data-mode]')) {
      this.#pressed(button, button.dataset.mode === mode);
    }
  }

  #pressed(button, isPressed) {
    button.setAttribute('aria-pressed', String(isPressed));
  }

  /** Clicks in the view measure until this is switched off; they tag nothing meanwhile. */
  #measure(isOn) {
    this.#isMeasuring = isOn;
    this.#pressed(this.parts.measure, isOn);
    this.desk.live.send({ type: 'measure', on: isOn });
  }

  #send() {
    this.desk.live.send({ type: 'words', language, units: lengthUnit, late: this.#isLate });
    this.desk.live.send({ type: 'cut', half: this.parts.cut.value });
    this.desk.live.send({ type: 'measure', on: this.#isMeasuring });
    this.desk.live.send({ type: 'camera', mode: this.#mode });
  }
}

/** @param {{isAway: boolean, rests: boolean}} state */
function whyAbsent({ isAway, rests }) {
  if (isAway) return t('window.viewer_away');
  return rests ? t('viewer.rests') : t('viewer.no_webgl');
}

/** Right and down as shares of the view; null elsewhere. */
function placeOf(pointer) {
  const isPlace = Array.isArray(pointer) && pointer.length === 2 && pointer.every((share) => share >= 0 && share <= 1);
  return isPlace ? pointer : null;
}

/** Whether there is no graphics card: then half the size keeps a live page below 100 ms a picture. */
function isSlow(gl) {
  const names = gl.getExtension('WEBGL_debug_renderer_info');
  return names && /swiftshader|llvmpipe|basic render/i.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL));
}

customElements.define('viewer-panel', ViewerPanel);
