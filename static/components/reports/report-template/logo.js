/** Reads a logo from a file: as it is if the server takes it, else smaller. */

const MOST_BYTES = 200_000;
const MOST_PX = 4000;
/** Longer side of a logo that is reduced: paper shows no more. */
const ENOUGH_PX = 800;

/**
 * Returns the picture in base64, or null if the file is no picture.
 * @param {File} file
 */
export async function logoOf(file) {
  const bitmap = await bitmapOf(file);
  if (bitmap === null) return null;
  const { width, height } = bitmap;
  const isFit = /^image\/(png|jpeg)$/.test(file.type) && file.size <= MOST_BYTES && Math.max(width, height) <= MOST_PX;
  try {
    for (let longest = ENOUGH_PX, made = /** @type {Blob|null} */ (isFit ? file : null); ; longest /= 2) {
      made ??= await reduced(bitmap, longest);
      if (made.size <= MOST_BYTES) return base64(made);
      made = null;
    }
  } finally {
    bitmap.close();
  }
}

async function bitmapOf(file) {
  try {
    return await createImageBitmap(file);
  } catch (error) {
    if (error.name === 'InvalidStateError') return null;
    throw error;
  }
}

function reduced(bitmap, longest) {
  const scale = Math.min(1, longest / Math.max(bitmap.width, bitmap.height));
  const canvas = new OffscreenCanvas(
    Math.max(1, Math.round(bitmap.width * scale)),
    Math.max(1, Math.round(bitmap.height * scale)),
  );
  canvas.getContext('2d').drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  return canvas.convertToBlob({ type: 'image/png' });
}

async function base64(file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = '';
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(text);
}

/** The address of a logo for an <img>: the kind of its file is in its first letters. */
export const logoAddress = (logo) => `data:image/${logo.startsWith('iVBOR') ? 'png' : 'jpeg'};base64,${logo}`;
