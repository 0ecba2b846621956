/**
 * Brightness, contrast, gamma and local contrast of the film on the screen. The film, the photos and what is
 * measured stay as they are; this browser remembers the choice.
 */

import { html, render } from '../../../core/page/html.js';
import { recallMembers, remember } from '../../../core/page/remembered.js';
import { Component } from '../../../core/page/store.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { closesElsewhere } from '../../shared/menu/menu.js';

const REMEMBERED = 'chainage.look';
const PLAIN = { brightness: 0, contrast: 1, gamma: 1, local: 0 };
const FIELDS = [
  ['brightness', t('look.brightness'), -0.5, 0.5],
  ['contrast', t('look.contrast'), 0.5, 2.5],
  ['gamma', t('look.gamma'), 0.4, 2.5],
  ['local', t('look.local'), 0, 2],
];
/** Of the blur that local contrast is measured against, in px of the shown picture. */
const LOCAL_PX = 24;

export class PictureLook extends Component {
  #look = recallMembers(REMEMBERED, PLAIN);

  mount() {
    /** @type {Parts<'video/picture-look'>} */
    this.parts = render(
      this,
      html`<details class="menu holds" data-part="menu">
          <summary class="button button--small button--icon stage__tool" aria-label="${t('look.title')}"
            title="${t('look.title')}">${icon('contrast')}</summary>
          <div class="menu__list panel look" role="group" aria-label="${t('look.title')}">
            ${FIELDS.map(
              ([name, label, min, max]) => html`<label class="look__field stack">${label}
              <input class="full" type="range" min="${min}" max="${max}" step="0.05" data-part="${name}" /></label>`,
            )}
            <p class="help">${t('look.help')}</p>
            <button class="button button--small" data-part="reset">${icon('undo')}${t('look.reset')}</button>
          </div>
        </details>
        <svg class="look__filter" aria-hidden="true"><filter id="film-look" color-interpolation-filters="sRGB"
            x="0" y="0" width="100%" height="100%">
          <feComponentTransfer><feFuncR type="gamma" data-part="gammaR" /><feFuncG type="gamma" data-part="gammaG" />
            <feFuncB type="gamma" data-part="gammaB" /></feComponentTransfer>
          <feComponentTransfer result="even"><feFuncR type="linear" data-part="lineR" /><feFuncG type="linear" data-part="lineG" />
            <feFuncB type="linear" data-part="lineB" /></feComponentTransfer>
          <feGaussianBlur stdDeviation="${LOCAL_PX}" edgeMode="duplicate" />
          <feComposite in="even" operator="arithmetic" data-part="composite" />
        </filter></svg>`,
    );
    closesElsewhere(this.parts.menu, this.signal);
    for (const [name] of FIELDS) {
      this.listen(this.parts[name], 'input', ({ target }) =>
        this.#choose({ ...this.#look, [name]: Number(target.value) }),
      );
    }
    this.listen(this.parts.reset, 'click', () => this.#choose(PLAIN));
    this.#show();
  }

  #choose(look) {
    this.#look = look;
    remember(REMEMBERED, look);
    this.#show();
  }

  #show() {
    const { parts } = this;
    const { brightness, contrast, gamma, local } = this.#look;
    for (const [name] of FIELDS) parts[name].value = this.#look[name];
    for (const colour of ['R', 'G', 'B']) {
      // Above 1 the dark parts become lighter, as people expect of a gamma.
      parts[`gamma${colour}`].setAttribute('exponent', 1 / gamma);
      parts[`line${colour}`].setAttribute('slope', contrast);
      parts[`line${colour}`].setAttribute('intercept', 0.5 - 0.5 * contrast + brightness);
    }
    // The picture plus its deviation from its surroundings.
    for (const [name, value] of [
      ['k1', 0],
      ['k2', 1 + local],
      ['k3', -local],
      ['k4', 0],
    ]) {
      parts.composite.setAttribute(name, value);
    }
    const isPlain = Object.keys(PLAIN).every((name) => this.#look[name] === PLAIN[name]);
    parts.reset.disabled = isPlain;
    parts.menu.querySelector('summary').classList.toggle('stage__tool--on', !isPlain);
    // Without a filter the picture costs nothing.
    this.closest('video-panel').classList.toggle('has-look', !isPlain);
  }
}

customElements.define('picture-look', PictureLook);
