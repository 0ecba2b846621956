/** The list of all keys, in a dialog. */

import { html, render } from '../../core/html.js';
import { icon } from '../icon/icon.js';

/**
 * @param {{title: string, bindings: import('../../core/keys.js').Binding[]}[]} groups
 * @returns {HTMLDialogElement} to be put into the page and opened with showModal()
 */
export function keyHelp(groups) {
  const dialog = document.createElement('dialog');
  dialog.className = 'key-help';
  dialog.setAttribute('aria-labelledby', 'key-help-title');
  const { close } = render(
    dialog,
    html`<div class="key-help__head">
        <h2 id="key-help-title">Keys</h2>
        <button class="button button--quiet button--icon" data-part="close" aria-label="Close">${icon('close')}</button>
      </div>
      <div class="key-help__groups">
        ${groups.map(({ title, bindings }) => html`<section><h3>${title}</h3>
          <dl>${bindings.map(({ keys, shown, label }) => html`<div><dt>${(shown ?? keys).map((key, i) => html`${
            i > 0 && ' or '}<kbd>${key}</kbd>`)}</dt><dd>${label}</dd></div>`)}</dl></section>`)}
        <section><h3>Mouse and touch</h3><dl>
          <div><dt>Picture</dt><dd>Click a point of the wall to tag it there</dd></div>
          <div><dt>Strip</dt><dd>Click or drag to go to a distance</dd></div>
          <div><dt>3D view</dt><dd>Drag to turn, wheel to come closer</dd></div>
        </dl></section>
      </div>`,
  );
  close.addEventListener('click', () => dialog.close());
  dialog.addEventListener('click', (event) => {
    if (event.target === dialog) dialog.close();
  });
  return dialog;
}
