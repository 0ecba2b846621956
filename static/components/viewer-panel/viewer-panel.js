/** The 3D culvert in its frame, and where its camera stands. */

import { html, render } from '../../core/html.js';
import { Component } from '../../core/store.js';

const REMEMBERED = 'chainage.camera';
const CAMERAS = [
  ['follow', 'Follow', 'Behind the robot'],
  ['overview', 'Overview', 'The whole culvert'],
  ['inside', 'Inside', 'As the robot sees it'],
];

class ViewerPanel extends Component {
  /** Called with the window of the 3D view once it is there, to hear its keys. */
  onframe = null;

  #mode;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', '3D view');
    const { id } = this.desk.inspection;
    const hasWebgl = document.createElement('canvas').getContext('webgl2') !== null;
    this.parts = render(
      this,
      html`<div class="viewer__head">
          <h2>3D view</h2>
          <div class="viewer__cameras" role="group" aria-label="Camera of the 3D view">
            ${CAMERAS.map(([mode, label, title]) => html`<button class="button button--small" data-mode="${mode}"
              aria-pressed="false" title="${title}">${label}</button>`)}
          </div>
        </div>
        <div class="viewer__stage">
          ${hasWebgl
            ? html`<iframe src="/viewer/${id}/" title="3D view of the culvert" data-part="frame"></iframe>`
            : html`<p class="message">The 3D view needs WebGL 2, which this browser does not offer. Everything else
                works without it.</p>`}
        </div>`,
    );
    for (const button of this.querySelectorAll('[data-mode]')) {
      this.listen(button, 'click', () => this.#choose(button.dataset.mode));
    }
    if (hasWebgl) {
      this.listen(this.parts.frame, 'load', () => this.onframe?.(this.parts.frame.contentWindow));
    }
    this.listen(this.desk.live, 'state', () => this.#send());
    this.#choose(localStorage.getItem(REMEMBERED) ?? 'follow');
  }

  #choose(mode) {
    this.#mode = mode;
    localStorage.setItem(REMEMBERED, mode);
    this.#send();
    for (const button of this.querySelectorAll('[data-mode]')) {
      button.setAttribute('aria-pressed', String(button.dataset.mode === mode));
    }
  }

  #send() {
    this.desk.live.send({ type: 'camera', mode: this.#mode });
  }
}

customElements.define('viewer-panel', ViewerPanel);
