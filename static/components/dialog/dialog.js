/** Modal dialogs: the page beneath is inert until they are closed. */

import { html, render } from '../../core/html.js';
import { t } from '../../core/words.js';
import { icon } from '../icon/icon.js';

let opened = 0;

/**
 * Shows a dialog. It closes by its cross, by Escape, by a click outside it, or by `dialog.close(value)`.
 * @param {object} options
 * @param {string} options.title
 * @param {ReturnType<typeof html>} options.content
 * @param {'narrow'|'wide'} [options.size]
 * @returns {{dialog: HTMLDialogElement, parts: Record<string, HTMLElement>, closed: Promise<string>}}
 *     parts: those of the content; closed: the value it was closed with, '' when it was dismissed
 */
export function openDialog({ title, content, size = 'narrow' }) {
  opened += 1;
  const id = `dialog-${opened}`;
  const dialog = document.createElement('dialog');
  dialog.className = `dialog dialog--${size}`;
  dialog.setAttribute('aria-labelledby', id);
  const parts = render(
    dialog,
    html`<div class="dialog__head">
        <h2 id="${id}">${title}</h2>
        <button type="button" class="button button--quiet button--icon" data-part="close"
          aria-label="${t('page.close')}">${icon('close')}</button>
      </div>
      <div class="dialog__body">${content}</div>`,
  );
  parts.close.addEventListener('click', () => dialog.close());
  dialog.addEventListener('mousedown', ({ target }) => target === dialog && dialog.close());
  const closed = new Promise((resolve) => {
    dialog.addEventListener('close', () => {
      dialog.remove();
      resolve(dialog.returnValue);
    });
  });
  document.body.append(dialog);
  dialog.showModal();
  return { dialog, parts, closed };
}
