/** A short message beside the work, with an action where one helps; the next one takes its place. */

import { refusalIn, session } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { Component } from '../../../core/page/store.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../icon/icon.js';

const STAYS_MS = 7000;

export class ToastStack extends Component {
  mount() {
    this.setAttribute('role', 'status');
    this.setAttribute('aria-live', 'polite');
  }

  /** @param {Options & {text: string}} message */
  show({ text, kind = 'info', action, run, isUnreachable = false }) {
    const toast = document.createElement('div');
    toast.className = `toast row gap-3 toast--${kind}`;
    const parts = render(
      toast,
      html`${kind === 'error' && icon('alert')}<p>${text}</p>
        ${action && html`<button class="button button--small" data-part="action">${action}</button>`}
        <button class="button button--quiet button--small button--icon" data-part="close"
          aria-label="${t('page.dismiss')}">${icon('close')}</button>`,
    );
    const leave = () => toast.remove();
    parts.close.addEventListener('click', leave);
    parts.action?.addEventListener('click', () => {
      leave();
      run();
    });
    this.replaceChildren(toast);
    if (kind === 'error') this.#leaveOnceOver(toast, isUnreachable);
    else this.#leaveLater(toast);
  }

  /** A fault stays until somebody has seen it: the person goes on, or the server answers again if it did not. */
  #leaveOnceOver(toast, isUnreachable) {
    const seen = new AbortController();
    const over = () => {
      seen.abort();
      this.#leaveLater(toast);
    };
    const { signal } = seen;
    // By capture at the window, which the key or the click that failed has passed already.
    for (const type of ['pointerdown', 'keydown']) addEventListener(type, over, { signal, capture: true });
    if (isUnreachable) session.addEventListener('answered', over, { signal });
  }

  /** Removes a toast later; it stays while it is pointed at or has the focus. */
  #leaveLater(toast) {
    const timer = setInterval(() => {
      if (toast.matches(':hover, :focus-within')) return;
      clearInterval(timer);
      toast.remove();
    }, STAYS_MS);
  }
}

customElements.define('toast-stack', ToastStack);

/**
 * @typedef {{kind?: 'info'|'error', action?: string, run?: () => void, isUnreachable?: boolean}} Options
 *
 * @param {string} text
 * @param {Options} [options]
 */
export function toast(text, options = {}) {
  document.querySelector('toast-stack').show({ text, ...options });
}

/** Shows why something failed. */
export const toastError = (error) => toast(errorText(error), { kind: 'error', isUnreachable: error.status === 0 });

/** Runs a command of the person; a refusal of the server is shown. */
export async function orToast(run) {
  try {
    await run();
  } catch (error) {
    if (!refusalIn(error)) return;
    toastError(error);
  }
}
