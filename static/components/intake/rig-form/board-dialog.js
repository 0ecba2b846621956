/** The lens by the film of a calibration board, in a dialog. */

import { ApiError, post } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { Upload } from '../../../core/server/upload.js';
import { count } from '../../../core/wall/units.js';
import { errorText, t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { toastError } from '../../shared/toast-stack/toast-stack.js';

const NUMBERS = [
  ['columns', t('board.columns'), ''],
  ['rows', t('board.rows'), ''],
  ['square', t('board.square'), 'mm'],
  ['marker', t('board.marker'), 'mm'],
];

/**
 * Asks for the film and the board, and measures the camera on the server.
 * @param {'pinhole'|'fisheye'} model
 * @returns {Promise<{camera: object, focal_percent: number}|null>} null: it was dismissed
 */
export async function askBoard(model) {
  const { dialog, parts, closed } = openDialog({
    title: t('board.title'),
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <p>${t('board.text')}</p>
      <div class="field"><label for="board-film">${t('board.film')}</label>
        <input class="input" type="file" accept="video/*" id="board-film" data-part="film" /></div>
      <div class="field"><label for="board-kind">${t('board.kind')}</label>
        <select class="input" id="board-kind" data-part="kind">
          <option value="checkerboard">${t('board.checkerboard')}</option>
          <option value="charuco">${t('board.charuco')}</option></select>
        <span class="help">${t('board.kind_help')}</span></div>
      <div class="rig__grid fields gap-4">
        ${NUMBERS.map(
          ([
            name,
            label,
            unit,
          ]) => html`<div class="field" data-part="${name}Field"><label for="board-${name}">${label}</label>
          <span class="input-with-unit"><input class="input" id="board-${name}" inputmode="decimal" autocomplete="off" data-part="${name}" />
          <span class="unit">${unit}</span></span></div>`,
        )}
      </div>
      <div role="status" data-part="said"></div>
      <p class="fault" role="alert" data-part="fault"></p>
      <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
        <button type="button" class="button button--primary" data-part="take" hidden>${t('board.take')}</button>
        <button class="button button--primary" data-part="measure">${t('board.measure')}</button></div></form>`,
    size: 'wide',
  });
  const ended = new AbortController();
  /** @type {Upload|null} */
  let upload = null;
  let found = null;
  let isTaken = false;
  const showKind = () => (parts.markerField.hidden = parts.kind.value !== 'charuco');
  const say = (text) => render(parts.said, html`<p class="message">${icon('wait')}<span>${text}</span></p>`);

  const measure = async () => {
    const [file] = parts.film.files;
    const board = boardOf(parts, model);
    parts.fault.textContent = file && board ? '' : t('board.incomplete');
    if (!file || !board) return;
    await upload?.cancel(); // of a film before this one
    upload = new Upload(file, file.name);
    upload.addEventListener('change', () =>
      say(t('films.sending', { percent: Math.floor((100 * upload.offset) / upload.size) })),
    );
    await upload.start();
    if (upload.state !== 'DONE') throw new ApiError(0, 'upload_failed', upload.reason ?? '');
    say(t('board.measuring'));
    found = await post(`/api/uploads/${upload.id}/lens`, board, ended.signal);
    render(parts.said, words(found));
    parts.take.hidden = false;
    parts.take.focus();
  };

  showKind();
  parts.kind.addEventListener('change', showKind);
  parts.take.addEventListener('click', () => {
    isTaken = true;
    dialog.close();
  });
  parts.form.addEventListener('submit', async (event) => {
    event.preventDefault();
    parts.measure.disabled = true;
    parts.take.hidden = true;
    try {
      await measure();
    } catch (error) {
      if (error.name !== 'AbortError') {
        if (!(error instanceof ApiError)) throw error;
        render(parts.said, html``);
        parts.fault.textContent = upload?.reason ?? errorText(error);
      }
    }
    parts.measure.disabled = false;
  });
  await closed;
  ended.abort();
  upload?.cancel().catch(toastError); // what was found does not depend on it
  return isTaken ? found : null;
}

/**
 * Returns the board for the API, or null if a number is missing.
 * @param {Record<string, any>} parts of the form
 * @param {Api['BoardIn']['model']} model
 */
function boardOf({ kind, columns, rows, square, marker }, model) {
  const number = ({ value }) => Number(value.trim().replace(',', '.'));
  const board = { columns: number(columns), rows: number(rows), square_mm: number(square), model };
  if (kind.value === 'charuco') board.marker_mm = number(marker);
  return Object.values(board).every((value) => value === model || Number(value) > 0) ? board : null;
}

/** Returns how good a calibration is; what to do better comes from the server. */
const words = ({
  pictures,
  camera,
  focal_percent: percent,
  coverage,
  weaknesses,
}) => html`<p class="message">${icon('check')}
  <span>${t('board.found', {
    n: pictures,
    count: count(pictures),
    focal: camera.fx.toFixed(1),
    percent: percent.toFixed(2),
    covered: Math.round(100 * coverage),
  })}</span></p>
  ${weaknesses.length > 0 && html`<ul class="rig-picture__findings">${weaknesses.map((each) => html`<li>${each}</li>`)}</ul>`}`;
