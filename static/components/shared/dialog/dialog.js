/** Modal dialogs: the page beneath is inert until they are closed. */

import { html, render } from '../../../core/page/html.js';
import { refusalIn } from '../../../core/server/api.js';
import { errorText, t } from '../../../core/page/words.js';
import { icon } from '../icon/icon.js';
import { message } from '../message/message.js';

let opened = 0;

/**
 * Shows a dialog. It closes by its cross, its part `cancel`, by Escape, by a click outside it, or by
 * `dialog.close(value)`.
 *
 * @typedef {{title: string, text: string, submit: string, cancel?: string}} Question the last two are the words on
 *     the buttons that go ahead and back
 *
 * @param {object} options
 * @param {string} options.title
 * @param {ReturnType<typeof html>} options.content
 * @param {'narrow'|'wide'} [options.size]
 * @param {() => Question|null} [options.question] what is asked before the cross or Escape loses something, null
 *     while there is nothing to lose; a click outside is ignored until then
 * @returns {{dialog: HTMLDialogElement, parts: Record<string, any>, closed: Promise<string>}}
 *     parts: those of the content; closed: the value it was closed with, '' when it was dismissed
 */
export function openDialog({ title, content, size = 'narrow', question = () => null }) {
  opened += 1;
  const id = `dialog-${opened}`;
  const dialog = document.createElement('dialog');
  dialog.className = `dialog dialog--${size}`;
  dialog.setAttribute('aria-labelledby', id);
  const parts = render(
    dialog,
    html`<div class="dialog__head row gap-3 apart line-below">
        <h2 id="${id}">${title}</h2>
        <button type="button" class="button button--quiet button--icon" data-part="close"
          aria-label="${t('page.close')}">${icon('close')}</button>
      </div>
      <div class="dialog__body stack gap-4">${content}</div>`,
  );
  const dismiss = async () => {
    const asked = question();
    if (asked === null || (await ask(asked))) dialog.close();
  };
  const guard = (event) => {
    if (question() === null) return;
    event.preventDefault();
    dismiss();
  };
  parts.close.addEventListener('click', dismiss);
  parts.cancel?.addEventListener('click', () => dialog.close());
  dialog.addEventListener('mousedown', ({ target }) => target === dialog && question() === null && dialog.close());
  // A gesture that goes back is a `cancel` only; of several Escapes in a row browsers let only the first be prevented there.
  dialog.addEventListener('cancel', (event) => event.target === dialog && guard(event));
  dialog.addEventListener('keydown', (event) => event.key === 'Escape' && guard(event));
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

/**
 * Asks before something is lost.
 * @param {Question} question
 * @returns {Promise<boolean>} whether to go ahead
 */
export async function ask({ title, text, submit, cancel = t('page.cancel') }) {
  const { parts, closed } = openDialog({
    title,
    content: html`<form method="dialog" class="stack gap-4"><p>${text}</p><div class="dialog__buttons">
      <button type="button" class="button" data-part="cancel">${cancel}</button>
      <button class="button button--danger" value="yes">${submit}</button></div></form>`,
  });
  parts.cancel.focus();
  return (await closed) === 'yes';
}

/** The foot of a form in a dialog: its refusal, a way out, and the button that sends it. @param {string} submit */
export const formFoot = (submit) => html`<div class="unless-empty" role="alert" data-part="fault"></div>
  <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
    <button class="button button--primary" data-part="submit">${submit}</button></div>`;

/**
 * Shows a refusal of the server in the part `fault` of a dialog, whose part `submit` waits for the answer.
 * @param {Record<string, any>} parts
 * @param {() => Promise<unknown>} send
 */
export async function orFault({ fault, submit }, send) {
  render(fault, html``);
  if (submit) submit.disabled = true;
  try {
    await send();
  } catch (error) {
    const refusal = refusalIn(error);
    if (refusal) render(fault, message('error', errorText(refusal)));
  }
  if (submit) submit.disabled = false;
}

/**
 * Closes a dialog as 'done' once the server has accepted what the part `form` sends.
 * @param {ReturnType<typeof openDialog>} opened
 * @param {() => Promise<unknown>} send false: the form itself shows a fault
 */
export function closesWhenSent({ dialog, parts }, send) {
  parts.form.addEventListener('submit', (event) => {
    event.preventDefault();
    orFault(parts, async () => (await send()) !== false && dialog.close('done'));
  });
}
