/** Imports a table into the register: what it would do is shown first. */

import { refusalIn } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { MOST_BYTES, importTable } from '../../../core/survey/register.js';
import { bytes, count } from '../../../core/wall/units.js';
import { errorText, t, wordFor } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';

/** Rows that are shown of those without a fault. */
const SHOWN = 20;

/**
 * Asks for a table, shows what it would do, and imports it.
 * @returns {Promise<{added: number, changed: number}|null>} what was done; null: it was dismissed
 */
export async function importAssets() {
  const { dialog, parts, closed } = openDialog({
    title: t('register.import_title'),
    content: dialogMarkup(),
    size: 'wide',
  });
  const left = new AbortController();
  let file = null;
  let done = null;

  const during = async (run) => {
    parts.pick.disabled = parts.take.disabled = true;
    parts.fault.textContent = '';
    try {
      await run();
    } catch (error) {
      if (!refusalIn(error)) return;
      parts.fault.textContent = errorText(error);
      parts.state.textContent = '';
    }
    parts.pick.disabled = parts.take.disabled = false;
  };

  const showResult = (found) => {
    render(parts.state, countsMarkup(found));
    render(parts.result, resultMarkup(found));
  };

  const tryOut = (chosen) =>
    during(async () => {
      file = chosen;
      parts.result.replaceChildren();
      parts.state.textContent = '';
      parts.take.hidden = true;
      parts.name.textContent = `${file.name} · ${bytes(file.size)}`;
      if (file.size > MOST_BYTES) {
        parts.fault.textContent = t('register.too_large', { size: bytes(file.size), most: bytes(MOST_BYTES) });
        return;
      }
      parts.state.textContent = t('register.checking');
      const found = await importTable(file, true, left.signal);
      const changes = found.added + found.changed;
      showResult(found);
      parts.take.textContent = t('register.take_all', { n: changes, count: count(changes) });
      parts.take.hidden = found.faulty > 0 || changes === 0;
    });

  parts.pick.addEventListener('click', () => parts.input.click());
  parts.input.addEventListener('change', () => {
    const [chosen] = parts.input.files;
    if (chosen) tryOut(chosen);
    parts.input.value = ''; // so that the repaired file can be chosen again
  });
  for (const type of ['dragover', 'dragleave', 'drop']) {
    parts.drop.addEventListener(type, (event) => {
      event.preventDefault();
      parts.drop.classList.toggle('drop--over', type === 'dragover');
      if (type === 'drop' && event.dataTransfer.files.length && !parts.pick.disabled)
        tryOut(event.dataTransfer.files[0]);
    });
  }
  parts.take.addEventListener('click', () =>
    during(async () => {
      parts.state.textContent = t('register.importing');
      // The register may have changed since the dry run: what is done now is what counts.
      const found = await importTable(file, false, left.signal);
      if (found.faulty === 0) {
        done = found;
        dialog.close();
      } else showResult(found);
    }),
  );
  parts.pick.focus();
  await closed;
  left.abort();
  return done;
}

const dialogMarkup = () => html`<div class="drop register__drop" data-part="drop"><div class="drop__ask stack">
    ${icon('upload')}<p>${t('register.drop')}</p>
    <div class="drop__buttons flow"><button type="button" class="button" data-part="pick">${t('register.pick')}</button>
      <a class="button" href="/api/register/template.csv" download>${icon('download')}${t('register.template')}</a></div>
    <p class="help">${t('register.columns')}</p></div>
    <input type="file" accept=".csv,.txt,.tsv,text/csv" aria-label="${t('register.pick')}" data-part="input" hidden /></div>
  <div class="row gap-row wrap"><b data-part="name"></b><div role="status" data-part="state"></div></div>
  <p class="fault" role="alert" data-part="fault"></p>
  <div class="unless-empty stack gap-3 shrinks" data-part="result"></div>
  <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
    <button type="button" class="button button--primary" data-part="take" hidden></button></div>`;

const countsMarkup = ({ added, changed, same, faulty }) => html`<ul class="flow">
  <li class="chip">${t('register.count_add', { n: added, count: count(added) })}</li>
  <li class="chip">${t('register.count_change', { n: changed, count: count(changed) })}</li>
  <li class="chip">${t('register.count_same', { n: same, count: count(same) })}</li>
  ${faulty > 0 && html`<li class="chip chip--failed">${icon('alert')}${t('register.count_fault', { n: faulty, count: count(faulty) })}</li>`}</ul>`;

function resultMarkup({ added, changed, same, faulty, faults, warnings, rows, ignored }) {
  const good = rows.filter(({ action }) => action !== 'fault');
  const total = added + changed + same;
  return html`${ignored.length > 0 && html`<p class="message">${icon('info')}<span>${t('register.ignored', { n: ignored.length, names: ignored.join(', ') })}</span></p>`}
    ${
      faulty > 0 &&
      html`<p class="message message--error">${icon('alert')}<span>${t('register.repair')}${new Set(faults.map(({ row }) => row)).size < faulty && ` ${t('register.more_faults', { n: faults.length })}`}</span></p>
      ${tableMarkup(
        t('register.faults'),
        [t('register.column'), t('register.fault')],
        faults.map(({ row, column, detail }) => [
          row,
          column ?? t('register.whole_row'),
          html`<span lang="en">${detail}</span>`,
        ]),
      )}`
    }
    ${
      warnings.length > 0 &&
      html`<p class="message message--warning">${icon('alert')}<span>${t('register.alike')}</span></p>
      ${tableMarkup(
        t('register.alike'),
        [t('archive.asset'), t('register.known_as')],
        warnings.map(({ row, asset_id: id, same: others }) => [row, id, others.join(', ')]),
      )}`
    }
    ${
      good.length > 0 &&
      html`<h3>${t('register.first_rows', { n: Math.min(good.length, SHOWN), total: count(total) })}</h3>
      ${tableMarkup(
        t('register.result'),
        [t('archive.asset'), t('register.action')],
        good.slice(0, SHOWN).map(({ row, asset_id: id, action }) => [row, id, wordFor('register.actions', action)]),
      )}`
    }`;
}

function tableMarkup(title, heads, rows) {
  return html`<div class="register__rows framed" tabindex="0" role="region" aria-label="${title}"><table class="plain-table full">
  <thead><tr><th scope="col">${t('register.row')}</th>${heads.map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
  <tbody>${rows.map(([row, ...cells]) => html`<tr><td class="number">${row}</td>${cells.map((cell) => html`<td>${cell}</td>`)}</tr>`)}</tbody></table></div>`;
}
