/** What the films of a folder would get by rules that are not saved yet. */

import { ApiError, post } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { errorText, t } from '../../../core/page/words.js';
import { additionColumns, additionSummary } from '../add-films/additions.js';
import '../add-films/folder-picker.js';
import '../../shared/data-table/data-table.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { message } from '../../shared/message/message.js';

const SHOWN = 100;

/** Opens a dialog that asks for a folder and shows the dry run; nothing is stored. */
export function tryRules(rules, signal) {
  const { parts } = openDialog({
    title: t('rules.try_title'),
    content: html`<form class="stack gap-3 at-start" data-part="form">
      <folder-picker class="full" data-part="folder"></folder-picker>
      <button class="button button--primary">${t('rules.try_submit')}</button></form>
      <div role="status" data-part="result"></div>
      <data-table data-part="table" hidden></data-table>`,
    size: 'wide',
  });
  parts.table.fill({ caption: t('rules.try_title'), columns: additionColumns(), keyOf: ({ path }) => path });
  parts.form.addEventListener('submit', async (event) => {
    event.preventDefault();
    const { value: path } = parts.folder;
    if (!path) return render(parts.result, message('error', t('add.folder_needed')));
    render(parts.result, html`<p class="dim">${t('page.loading')}</p>`);
    try {
      const found = await post('/api/archive/films/preview', { paths: [path], rules }, signal);
      parts.folder.remember();
      render(
        parts.result,
        html`${additionSummary(found)}${found.films.length > SHOWN && html`<p class="dim">${t('add.first', { n: SHOWN })}</p>`}`,
      );
      parts.table.show(found.films.slice(0, SHOWN));
      parts.table.hidden = found.films.length === 0;
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      parts.table.hidden = true;
      render(parts.result, message('error', errorText(error)));
    }
  });
}
