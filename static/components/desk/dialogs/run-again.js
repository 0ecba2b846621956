/** Dialogs before a run is ended, continued, or tracked again with another rig. */

import { html } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { ask, closesWhenSent, formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { turned } from '../../intake/rig-form/fields.js';
import '../../intake/rig-form/rig-form.js';
import '../../intake/rig-form/rig-picture.js';
import '../../intake/source-picker/source-picker.js';

/** Asks whether the recording may be ended; the safe answer has the focus. */
export const askEndOfRecording = () =>
  ask({
    title: t('again.end_title'),
    text: t('again.end_text'),
    submit: t('again.end_submit'),
    cancel: t('again.end_keep'),
  });

/** Continues a stopped recording with its next part; says whether it does. */
export async function openRecordOn(inspection) {
  const opened = openForm(
    t('again.on_title'),
    t('again.on_submit'),
    html`<p>${t('again.on_text')}</p>
      <source-picker class="stack gap-3" data-part="camera"></source-picker>
      <fieldset class="again__robot stack"><legend class="strong">${t('again.robot')}</legend>
        <label><input type="radio" name="robot" value="stood_still" /> <b>${t('again.stood_still')}</b>
          <span class="help">${t('again.stood_still_help')}</span></label>
        <label><input type="radio" name="robot" value="moved" checked /> <b>${t('again.moved')}</b>
          <span class="help">${t('again.moved_help')}</span></label></fieldset>`,
  );
  const { form, camera } = opened.parts;
  closesWhenSent(opened, async () => {
    if (!camera.check()) return false;
    await inspection.recordOn(camera.value, form.querySelector('[name=robot]:checked').value);
    return camera.remember();
  });
  return (await opened.closed) === 'done';
}

/**
 * Tracks all frames again with a corrected rig, or with the same one; says whether it has begun.
 * @param {import('../../../core/survey/inspection.js').Inspection} inspection
 * @param {Record<string, number>} [changes] of the rig, which are shown first, by path
 */
export async function openRig(inspection, changes = {}) {
  const { id, rig, video } = inspection.value;
  const opened = openForm(
    t('again.rig_title'),
    t('again.rig_submit'),
    html`<p>${t('again.rig_text')}</p><rig-form data-part="rig"></rig-form>`,
  );
  const form = Object.assign(opened.parts.rig, { value: rig, video, picture: firstPicture(id) });
  form.change(changes);
  closesWhenSent(opened, () => form.check() && inspection.trackWith(form.value));
  return (await opened.closed) === 'done';
}

/**
 * Tracks all frames again with the camera turned about its optical axis, after a look at the first picture.
 * @param {import('../../../core/survey/inspection.js').Inspection} inspection
 * @param {number} degrees 90, -90 or 180; the dialog can still turn on
 * @returns {Promise<boolean>} whether tracking has started
 */
export async function openTurn(inspection, degrees) {
  const opened = openForm(
    t('again.turn_title'),
    t('again.rig_submit'),
    html`<p>${t('again.rig_text')}</p><rig-picture data-part="picture"></rig-picture>`,
  );
  const { picture } = opened.parts;
  /** @type {Record<string, any>} */
  let rig = inspection.value.rig;
  const turn = (by) => {
    rig = { ...rig, mount: { ...rig.mount, rotation_deg: turned(rig.mount.rotation_deg ?? 0, by) } };
    picture.rig = rig;
  };
  picture.source = firstPicture(inspection.id);
  turn(degrees);
  picture.addEventListener('turn', ({ detail }) => turn(detail));
  closesWhenSent(opened, () => inspection.trackWith(rig));
  return (await opened.closed) === 'done';
}

const firstPicture = (id) => `/api/inspections/${id}/frames/0.jpg`;

const openForm = (title, submit, content) =>
  openDialog({
    title,
    size: 'wide',
    content: html`<form class="stack gap-4" data-part="form" novalidate>${content}${formFoot(submit)}</form>`,
  });
