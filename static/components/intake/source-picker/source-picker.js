/**
 * The choice of a camera: on the network by its address, or from the server's list.
 *
 * `value` is the address in the form of the API, with user and password, which are stored nowhere.
 * Event `source`: another one is chosen, or its address is being changed.
 */

import { get, refusalIn } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { recall, remember } from '../../../core/page/remembered.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { addressOf, withLogin, withoutSecrets } from './address.js';

const REMEMBERED = 'chainage.cameras';
const MOST_REMEMBERED = 6;
const NETWORK = 'network';
const EXAMPLE = 'rtsp://192.168.1.20:554/stream1';
const KINDS = {
  usb: ['video', t('source.usb')],
  folder: ['film', t('source.folder')],
  pipe: ['film', t('source.pipe')],
};

export class SourcePicker extends Component {
  mount() {
    const recent = recall(REMEMBERED, []);
    /** @type {Parts<'source-picker/source-picker'>} */
    this.parts = render(
      this,
      html`<fieldset class="stack">
          <legend class="visually-hidden">${t('source.which')}</legend>
          ${choice(NETWORK, 'network', t('source.network'), t('source.network_help'), true)}
          <div class="source__network stack gap-3 halves one-if-narrow" data-part="network">
            <div class="field whole-row">
              <label for="source-address">${t('source.address')}</label>
              <input class="input" id="source-address" type="text" inputmode="url" maxlength="2000" autocomplete="off"
                spellcheck="false" list="source-recent" placeholder="${EXAMPLE}" data-part="address"
                aria-describedby="source-address-fault source-address-help" />
              <span class="fault" id="source-address-fault" data-part="addressFault"></span>
              <span class="help" id="source-address-help">${t('source.address_help')}</span>
              <datalist id="source-recent">${recent.map((url) => html`<option value="${url}"></option>`)}</datalist>
            </div>
            <div class="field">
              <label for="source-user">${t('source.user')} <span class="required">${t('page.optional')}</span></label>
              <input class="input" id="source-user" maxlength="200" autocomplete="off" spellcheck="false" data-part="user" />
            </div>
            <div class="field">
              <label for="source-password">${t('source.password')} <span class="required">${t('page.optional')}</span></label>
              <input class="input" id="source-password" type="password" maxlength="200" autocomplete="new-password"
                data-part="password" aria-describedby="source-password-help" />
              <span class="help" id="source-password-help">${t('source.password_help')}</span>
            </div>
          </div>
          <div class="stack unless-empty" data-part="listed"></div>
        </fieldset>
        <div class="source__foot row wrap apart">
          <p class="help" role="status" data-part="found"></p>
          <button type="button" class="button button--small" data-part="refresh">${icon('retry')}${t('source.refresh')}</button>
        </div>
        <p class="fault" role="alert" data-part="fault"></p>`,
    );
    const { parts } = this;
    parts.address.value = recent[0] ?? '';
    this.listen(parts.refresh, 'click', () => this.#load());
    this.listen(parts.address, 'change', () => this.#takeLoginOut());
    this.listen(this, 'input', () => this.#changed());
    this.listen(this, 'change', () => this.#showChosen());
    this.#load();
  }

  /** The address with its log-in, or '' without an address. */
  get value() {
    const { address, user, password } = this.parts;
    if (this.#chosen !== NETWORK) return this.#chosen;
    return withLogin(address.value.trim(), user.value, password.value);
  }

  /** Shows a fault beside its field; returns whether there is none. */
  check() {
    const isGiven = this.value !== '';
    if (!isGiven) this.fault(t('source.address_needed'));
    return isGiven;
  }

  /** Shows why the source was refused, and focuses its field. */
  fault(text) {
    const isNetwork = this.#chosen === NETWORK;
    this.parts[isNetwork ? 'addressFault' : 'fault'].textContent = text;
    if (!isNetwork) return;
    this.parts.address.setAttribute('aria-invalid', 'true');
    this.parts.address.focus();
  }

  /** Stores the address, without its log-in, for the next time. */
  remember() {
    if (this.#chosen !== NETWORK) return;
    const recent = recall(REMEMBERED, []);
    const shown = withoutSecrets(this.parts.address.value.trim());
    const kept = [shown, ...recent.filter((url) => url !== shown)].slice(0, MOST_REMEMBERED);
    remember(REMEMBERED, kept);
  }

  get #chosen() {
    return this.querySelector('[name=source]:checked').value;
  }

  /** Moves the log-in of a pasted address to its fields, where it is hidden. */
  #takeLoginOut() {
    const { address, user, password } = this.parts;
    const found = addressOf(address.value.trim());
    address.value = found.address;
    if (found.user) [user.value, password.value] = [found.user, found.password];
  }

  #changed() {
    this.parts.fault.textContent = this.parts.addressFault.textContent = '';
    this.parts.address.setAttribute('aria-invalid', 'false');
    this.dispatchEvent(new Event('source'));
  }

  #showChosen() {
    this.parts.network.hidden = this.#chosen !== NETWORK;
  }

  async #load() {
    const { parts } = this;
    parts.refresh.disabled = true;
    try {
      this.#list((await get('/api/sources', this.signal)).sources);
    } catch (error) {
      if (!refusalIn(error)) return;
      parts.found.textContent = errorText(error);
    }
    parts.refresh.disabled = false;
  }

  /** Lists the sources of the server; the chosen one stays chosen while it is listed. */
  #list(sources) {
    const chosen = this.#chosen;
    render(
      this.parts.listed,
      html`${sources.map(({ url, kind, name }) => choice(url, KINDS[kind][0], name, KINDS[kind][1], url === chosen))}`,
    );
    if (!this.querySelector('[name=source]:checked')) this.querySelector('[name=source]').checked = true;
    this.parts.found.textContent = sources.length ? t('source.found', { n: sources.length }) : t('source.none');
    this.#showChosen();
  }
}

const choice = (value, sign, name, help, isChosen) => html`<label class="source__choice tile row gap-3 pad-row">
  <input type="radio" name="source" value="${value}" ${isChosen && html`checked`} />${icon(sign)}
  <span><b>${name}</b><span class="help">${help}</span></span></label>`;

customElements.define('source-picker', SourcePicker);
