/** The sections of a report: which are printed, and in which order. */

import { html, render } from '../../../core/page/html.js';
import { moved } from '../../../core/survey/report-template.js';
import { t, wordFor } from '../../../core/page/words.js';

/**
 * Keeps a list in step with a draft: by checkboxes, by buttons, by Alt and the arrows, by dragging.
 * @param {HTMLElement} list an <ol>
 * @param {() => import('../../../core/survey/report-template.js').TemplateDraft} draftOf
 * @param {import('../../../core/page/store.js').Component['listen']} listen
 */
export function followSections(list, draftOf, listen) {
  const placeOf = (element) => Number(element?.closest('[data-place]')?.dataset.place);
  const move = (from, to, focus) => {
    const { sections } = draftOf().value;
    if (to < 0 || to >= sections.length || to === from) return;
    draftOf().change({ sections: moved(sections, from, to) });
    list.children[to].querySelector(focus).focus();
  };
  listen(list, 'change', ({ target }) => {
    const place = placeOf(target);
    const sections = draftOf().value.sections.map((section, i) =>
      i === place ? { ...section, isOn: target.checked } : section,
    );
    draftOf().change({ sections });
    list.children[place].querySelector('input').focus();
  });
  listen(list, 'click', ({ target }) => {
    const { by } = target.closest('[data-by]')?.dataset ?? {};
    if (by)
      move(placeOf(target), placeOf(target) + Number(by), `[data-by="${by}"]:not(:disabled), [data-by]:not(:disabled)`);
  });
  listen(list, 'keydown', (event) => {
    const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!by || !event.altKey) return;
    event.preventDefault();
    move(placeOf(event.target), placeOf(event.target) + by, 'input');
  });
  let dragged = null;
  listen(list, 'dragstart', (event) => {
    dragged = placeOf(event.target);
    event.dataTransfer.effectAllowed = 'move';
  });
  listen(list, 'dragover', (event) => dragged !== null && event.preventDefault());
  listen(list, 'drop', (event) => {
    event.preventDefault();
    if (dragged !== null && event.target.closest('[data-place]')) move(dragged, placeOf(event.target), 'input');
  });
  listen(list, 'dragend', () => (dragged = null));
}

/** @param {import('../../../core/survey/report-template.js').Section[]} sections */
export function showSections(list, sections, mayEdit) {
  render(
    list,
    html`${sections.map(({ name, isOn }, i) => {
      const word = wordFor('report_template.section', name);
      return html`<li class="sections__item row framed apart" data-place="${i}" draggable="${String(mayEdit)}">
        <label><input type="checkbox" ${isOn && 'checked'} /> <span>${word}</span></label>
        ${
          mayEdit &&
          html`<span class="sections__ways">
          <button type="button" class="button button--small button--icon" data-by="-1" ${i === 0 && 'disabled'} aria-label="${t('rules.up', { name: word })}" title="${t('rules.earlier')}">↑</button>
          <button type="button" class="button button--small button--icon" data-by="1" ${i === sections.length - 1 && 'disabled'} aria-label="${t('rules.down', { name: word })}" title="${t('rules.later')}">↓</button></span>`
        }</li>`;
    })}`,
  );
}
