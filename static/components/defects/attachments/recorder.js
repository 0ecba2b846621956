/** Records a voice note with the browser's recorder. */

/** As the server accepts them, see `app/survey/observations/attachments.py`. */
export const LONGEST_S = 120;
const TYPES = ['audio/webm;codecs=opus', 'audio/mp4', 'audio/ogg;codecs=opus'];
/** Two minutes of speech are below the server's limit of 1 MiB. */
const BITS_PER_S = 32_000;

/** Whether this browser can record: never over plain http, except on this machine. */
export const canRecord = () => Boolean(navigator.mediaDevices?.getUserMedia && globalThis.MediaRecorder);

/**
 * Starts a recording; it ends by `stop`, or after `LONGEST_S`.
 * @param {(sound: Blob, durationS: number) => void} onDone
 * @returns {Promise<{stop: () => void, discard: () => void, since: number}>} `discard` ends it without `onDone`;
 *     `since` by `performance.now`
 * @throws {DOMException} there is no microphone, or the person refuses it
 */
export async function record(onDone) {
  const stream = await navigator.mediaDevices.getUserMedia({ audio: true });
  const mimeType = TYPES.find((type) => MediaRecorder.isTypeSupported(type));
  const recorder = new MediaRecorder(stream, { mimeType, audioBitsPerSecond: BITS_PER_S });
  const parts = [];
  const since = performance.now();
  let isDiscarded = false;
  const stop = () => recorder.state !== 'inactive' && recorder.stop();
  const timer = setTimeout(stop, 1000 * LONGEST_S);
  const warn = (event) => event.preventDefault(); // what is being said is nowhere yet
  addEventListener('beforeunload', warn);
  recorder.addEventListener('dataavailable', ({ data }) => parts.push(data));
  recorder.addEventListener('stop', () => {
    clearTimeout(timer);
    removeEventListener('beforeunload', warn);
    for (const track of stream.getTracks()) track.stop();
    if (isDiscarded) return;
    const seconds = Math.min(LONGEST_S, Math.max(0.1, (performance.now() - since) / 1000));
    onDone(new Blob(parts, { type: recorder.mimeType }), Math.round(10 * seconds) / 10);
  });
  recorder.start();
  const discard = () => {
    isDiscarded = true;
    stop();
  };
  return { stop, discard, since };
}
