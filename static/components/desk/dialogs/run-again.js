/** Dialogs before a run is ended, continued, or tracked again with another rig. */

import { ApiError } from '../../../core/server/api.js';
import { html, render } from '../../../core/page/html.js';
import { errorText, t } from '../../../core/page/words.js';
import { openDialog } from '../../shared/dialog/dialog.js';
import { icon } from '../../shared/icon/icon.js';
import { turned } from '../../intake/rig-form/fields.js';
import '../../intake/rig-form/rig-form.js';
import '../../intake/rig-form/rig-picture.js';
import '../../intake/source-picker/source-picker.js';

/** Asks whether the recording may be ended; the safe answer has the focus. */
export async function askEndOfRecording() {
  const { dialog, parts, closed } = openDialog({
    title: t('again.end_title'),
    content: html`<form method="dialog" class="stack gap-4" data-part="form"><p>${t('again.end_text')}</p>
      <div class="dialog__buttons"><button type="button" class="button" data-part="keep">${t('again.end_keep')}</button>
        <button class="button button--danger" value="end">${t('again.end_submit')}</button></div></form>`,
  });
  parts.keep.addEventListener('click', () => dialog.close());
  parts.keep.focus();
  return (await closed) === 'end';
}

/**
 * Continues a stopped recording with its next part.
 * @param {import('../../../core/survey/inspection.js').Inspection} inspection
 * @returns {Promise<boolean>} whether it continues
 */
export async function openRecordOn(inspection) {
  const { dialog, parts, closed } = openDialog({
    title: t('again.on_title'),
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <p>${t('again.on_text')}</p>
      <source-picker data-part="camera"></source-picker>
      <fieldset class="again__robot stack"><legend>${t('again.robot')}</legend>
        <label><input type="radio" name="robot" value="stood_still" /> <b>${t('again.stood_still')}</b>
          <span class="help">${t('again.stood_still_help')}</span></label>
        <label><input type="radio" name="robot" value="moved" checked /> <b>${t('again.moved')}</b>
          <span class="help">${t('again.moved_help')}</span></label></fieldset>
      ${foot(t('again.on_submit'))}</form>`,
    size: 'wide',
  });
  answered(dialog, parts, async () => {
    if (!parts.camera.check()) return false;
    const robot = parts.form.querySelector('[name=robot]:checked').value;
    await inspection.recordOn(parts.camera.value, robot);
    parts.camera.remember();
    return true;
  });
  return (await closed) === 'done';
}

/**
 * Tracks all frames again with a corrected rig, or with the same one.
 * @param {import('../../../core/survey/inspection.js').Inspection} inspection
 * @returns {Promise<boolean>} whether tracking has started
 */
export async function openRig(inspection) {
  const { id, rig, video } = inspection.value;
  const { dialog, parts, closed } = openDialog({
    title: t('again.rig_title'),
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <p>${t('again.rig_text')}</p>
      <rig-form data-part="rig"></rig-form>${foot(t('again.rig_submit'))}</form>`,
    size: 'wide',
  });
  parts.rig.value = rig;
  parts.rig.video = video;
  parts.rig.picture = `/api/inspections/${id}/frames/0.jpg`;
  answered(dialog, parts, async () => {
    if (!parts.rig.check()) return false;
    await inspection.trackWith(parts.rig.value);
    return true;
  });
  return (await closed) === 'done';
}

/**
 * Tracks all frames again with the camera turned about its optical axis, after a look at the first picture.
 * @param {import('../../../core/survey/inspection.js').Inspection} inspection
 * @param {number} degrees 90, -90 or 180; the dialog can still turn on
 * @returns {Promise<boolean>} whether tracking has started
 */
export async function openTurn(inspection, degrees) {
  const { id } = inspection.value;
  const { dialog, parts, closed } = openDialog({
    title: t('again.turn_title'),
    content: html`<form class="stack gap-4" data-part="form" novalidate>
      <p>${t('again.rig_text')}</p>
      <rig-picture data-part="picture"></rig-picture>${foot(t('again.rig_submit'))}</form>`,
    size: 'wide',
  });
  const { picture } = parts;
  /** @type {Record<string, any>} */
  let rig = inspection.value.rig;
  const turn = (by) => {
    rig = { ...rig, mount: { ...rig.mount, rotation_deg: turned(rig.mount.rotation_deg ?? 0, by) } };
    picture.rig = rig;
  };
  picture.source = `/api/inspections/${id}/frames/0.jpg`;
  turn(degrees);
  picture.addEventListener('turn', ({ detail }) => turn(detail));
  answered(dialog, parts, async () => {
    await inspection.trackWith(rig);
    return true;
  });
  return (await closed) === 'done';
}

/** Closes the dialog as 'done' once the server has accepted the request of `send`; else shows the reason. */
function answered(dialog, parts, send) {
  parts.form.addEventListener('submit', async (event) => {
    event.preventDefault();
    render(parts.fault, html``);
    parts.submit.disabled = true;
    try {
      if (await send()) dialog.close('done');
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      render(parts.fault, html`<p class="message message--error">${icon('alert')}<span>${errorText(error)}</span></p>`);
    }
    parts.submit.disabled = false;
  });
}

const foot = (submit) => html`<div role="alert" data-part="fault"></div>
  <div class="dialog__buttons"><button type="button" class="button" data-part="cancel">${t('page.cancel')}</button>
    <button class="button button--primary" data-part="submit">${submit}</button></div>`;
