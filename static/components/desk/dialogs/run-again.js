/** Dialogs before a run is ended, continued, or tracked again with another rig. */

import { html } from '../../../core/page/html.js';
import { CHANGES, causeText } from '../../../core/survey/diagnosis.js';
import { t, wordFor } from '../../../core/page/words.js';
import { ask, closesWhenSent, formFoot, openDialog } from '../../shared/dialog/dialog.js';
import { turned } from '../../intake/rig-form/fields.js';
import '../../intake/rig-form/rig-form.js';
import '../../intake/rig-form/rig-picture.js';
import '../../intake/rig-wizard/rig-wizard.js';
import '../../intake/source-picker/source-picker.js';
import { message } from '../../shared/message/message.js';

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
 * Tracks all frames again: with a rig that is corrected in the film's own pictures, or with the same one. It says what
 * probably is wrong, and begins there.
 * @param {import('../page/desk.js').Desk} desk
 * @param {object} [first]
 * @param {string} [first.repair] one of CHANGES, or else nothing is opened
 * @param {Record<string, number>} [first.changes] of the rig, which are shown first, by path
 * @returns {Promise<boolean>} whether it has begun
 */
export async function openRig({ inspection, diagnosis }, { repair = '', changes = {} } = {}) {
  const { id, rig, video } = inspection.value;
  const causes = diagnosis.value?.causes ?? [];
  const opened = openForm(
    t('again.rig_title'),
    t('again.rig_submit'),
    html`<p>${t('again.rig_text')}</p>
      ${causes.map((cause) => message('warning', causeText(cause)))}
      <div class="flow" role="group" aria-label="${t('again.change')}"><span class="strong">${t('again.change')}</span>
        ${CHANGES.map((change) => html`<button type="button" class="button button--small" data-change="${change}">${wordFor('repair_button', change)}</button>`)}
        <span class="help">${t('again.change_help')}</span></div>
      <rig-wizard class="stack one-column" data-part="wizard"></rig-wizard>
      <rig-form data-part="rig"></rig-form>`,
  );
  const { wizard, rig: form } = opened.parts;
  Object.assign(form, { value: rig, video, picture: firstPicture(id) });
  Object.assign(wizard, { rig: form, film: `/api/inspections/${id}` });
  const before = JSON.stringify(form.value);
  form.change(changes);
  const begin = (change) => {
    if (change === 'axis' || (change === 'pipe' && form.value.mount.view === 'forward')) {
      wizard.open(change === 'axis' ? 'axis' : 'width');
      wizard.scrollIntoView();
    } else form.goTo(change === 'lens' ? 'camera' : 'pipe');
  };
  for (const button of opened.dialog.querySelectorAll('[data-change]')) {
    button.addEventListener('click', () => begin(button.dataset.change));
  }
  if (CHANGES.includes(repair)) begin(repair);
  closesWhenSent(opened, () => {
    if (JSON.stringify(form.value) === before) return inspection.retry();
    return form.check() && inspection.trackWith(form.value);
  });
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
