/** Pages of the inspection that the server of the tests has tracked, without their elements. */

import { line } from './browser.js';
import { AttachmentOutbox } from '../../static/core/server/attachment-outbox.js';
import { Catalogue } from '../../static/core/defects/codes.js';
import { Inspection } from '../../static/core/survey/inspection.js';
import { newId } from '../../static/core/page/new-id.js';
import { Operations } from '../../static/core/server/operations.js';
import { Outbox } from '../../static/core/server/outbox.js';
import { WallGrid } from '../../static/core/wall/wall.js';
import { Desk } from '../../static/components/desk/page/desk.js';

export const PATH = `/api/inspections/${process.env.CHAINAGE_INSPECTION}`;
export const TAG = { frame: 4, pixel: [159.5, 119.5], code: 'BAB', severity: 2 };
export const UNSTATED = {
  zero: null, lengths: [], joints: { use: null, marked: [], left_out: [] }, rig_sigma: null, forced: null, remark: null,
};
const LOOK_AGAIN_MS = 5;

/** Waits for a condition. */
export async function until(condition) {
  while (!(await condition())) await new Promise((resolve) => setTimeout(resolve, LOOK_AGAIN_MS));
}

/** The inspection with `count` tags and nothing stated; returns their ids. */
export async function tagged(count = 1) {
  const { observations } = await line.ask('GET', `${PATH}/observations`);
  for (const { id } of observations) await line.ask('DELETE', `${PATH}/observations/${id}`);
  await line.ask('PUT', `${PATH}/corrections`, UNSTATED);
  const ids = Array.from({ length: count }, newId);
  for (const id of ids) await change(id);
  return ids;
}

/** Somebody else changes a tag. */
export const change = (id, fields = {}) => line.ask('PUT', `${PATH}/observations/${id}`, { ...TAG, ...fields });
export const erase = (id) => line.ask('DELETE', `${PATH}/observations/${id}`);
export const stateZero = (offset_m) =>
  line.ask('PUT', `${PATH}/corrections`, { ...UNSTATED, zero: { frame: 2, offset_m } });

/** What is stored about each tag: [code, severity, remark]. */
export async function stored() {
  const { observations } = await line.ask('GET', `${PATH}/observations`);
  return observations.map(({ code, severity, remark }) => [code, severity, remark]).sort();
}

/**
 * Opens a page; two with the same `operations` are tabs of one browser, or a page and the same page after a reload.
 * @param {import('node:test').TestContext} t which the page outlives by nothing
 */
export async function opened(t, operations = new Operations(null)) {
  const lifetime = new AbortController();
  t.after(() => lifetime.abort());
  const { signal } = lifetime;
  const inspection = new Inspection(process.env.CHAINAGE_INSPECTION, signal);
  await inspection.load();
  const [catalogue, wall] = await Promise.all([Catalogue.load(signal, null), WallGrid.load(inspection.id, signal)]);
  const outbox = new Outbox(operations, await operations.all());
  const attachmentOutbox = await AttachmentOutbox.open(outbox, signal);
  const desk = new Desk({ inspection, outbox, attachmentOutbox, catalogue, wall }, signal);
  await Promise.all([desk.track.extend(signal), desk.observations.load(), desk.corrections.load()]);
  return desk;
}

/** Waits until everything is on the server and nothing is left to decide. */
export const settled = (desk) =>
  until(() => {
    const isSaved = desk.observations.value.every(({ save }) => save === 'saved');
    return isSaved && desk.outbox.openFor(desk.inspection.id).length === 0 && desk.conflicts.value.length === 0;
  });

/** Waits for a question about two versions, and returns it. */
export async function question(desk) {
  await until(() => desk.conflicts.value.length > 0);
  return desk.conflicts.value[0];
}
