/** Disagreements of picture and rig, the most serious first. */

import { html, render, setText } from '../../../core/page/html.js';
import { wordFor } from '../../../core/page/words.js';
import { Component } from '../../../core/page/store.js';
import { icon } from '../../shared/icon/icon.js';

export class RigNotice extends Component {
  mount() {
    const { corrections } = this.closest('inspection-page').desk;
    this.classList.add('message', 'message--warning');
    this.setAttribute('role', 'status');
    this.tabIndex = 0; // shown in full with the focus, or under the pointer
    const { text } = render(this, html`${icon('alert')}<span data-part="text"></span>`);
    const show = () => {
      const [notice] = corrections.value?.result?.notices ?? [];
      this.hidden = !notice;
      setText(text, notice ? wordFor('notice', notice.code, notice.params) : '');
    };
    this.listen(corrections, 'change', show);
    show();
  }
}

customElements.define('rig-notice', RigNotice);
