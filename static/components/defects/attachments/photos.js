/** The photos of a defect in their order: its own, further ones, and drawings on copies. */

/**
 * @typedef {object} Photo
 * @property {string} id of the observation or of the attachment
 * @property {import('../../../core/defects/attachments.js').Attachment|null} attachment null: the observation's own photo
 * @property {string|null} url null while the picture is not made
 * @property {number} frame
 * @property {object[]} strokes
 */

/**
 * @param {import('../../desk/page/desk.js').Desk} desk
 * @param {object} item the observation
 * @returns {Photo[]}
 */
export function photosOf(desk, item) {
  const attached = desk.attachments
    .of(item.id)
    .filter(({ kind }) => kind !== 'voice')
    .map((attachment) => ({
      ...pictureOf(desk, attachment),
      attachment,
      rank: attachment.rank,
      strokes: attachment.strokes,
    }));
  const own = item.photo
    ? [{ id: item.id, attachment: null, url: item.photo, frame: item.frame, rank: 0, strokes: [] }]
    : [];
  return [...own, ...attached].sort((a, b) => a.rank - b.rank); // stable: the own photo precedes others of its rank
}

/** Returns the address of the main photo of a defect, for a list; null while there is none. */
export const mainPhotoOf = (desk, item) =>
  desk.attachments.of(item.id).length === 0 ? item.photo : (photosOf(desk, item)[0]?.url ?? null);

/**
 * Until the server has it, the picture is the same frame as it is shown to everybody.
 * @param {import('../../desk/page/desk.js').Desk} desk
 * @param {import('../../../core/defects/attachments.js').Attachment} attachment
 */
const pictureOf = (desk, { id, frame, file }) => ({
  id,
  frame,
  url: file ?? `/api/inspections/${desk.inspection.id}/frames/${frame}.jpg`,
});
