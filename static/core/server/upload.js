/**
 * Resumable upload, tus 1.0.0 (https://tus.io/protocols/resumable-upload).
 *
 * The server's `Upload-Offset` alone states what has arrived: after any failure the offset is requested
 * again, never assumed. The address of an unfinished upload is stored, so that choosing the same file after
 * a reload resumes it.
 *
 * States: IDLE => SENDING <=> WAITING (for the server) ; SENDING <=> PAUSED ; => DONE | FAILED |
 * CANCELLED.
 */

import { ApiError, pause, refusalIn, send } from './api.js';
import { recall, remember } from '../page/remembered.js';
import { errorText, t } from '../page/words.js';

/**
 * @typedef {object} Unfinished an upload that was begun in this browser and not yet used
 * @property {string} key
 * @property {string} url
 * @property {string} name
 * @property {number} size
 * @property {boolean} [whole]
 * @property {string} [refused] why
 */

const CREATION = '/api/uploads';
const REMEMBERED = 'chainage.upload:';
const SMALLEST_PIECE = 256 * 1024;
const LARGEST_PIECE = 8 * 1024 * 1024;
const PAUSES_S = [0, 0.3, 1, 3, 5, 10];
const TUS = { 'Tus-Resumable': '1.0.0' };

/** @param {File} file @param {string} path */
const keyOf = (file, path) => `${REMEMBERED}${path}:${file.size}:${file.lastModified}`;

/** Whether a file can only be the archive file of an inspection, which is no film. @param {{name: string}} file */
export const isArchive = ({ name }) => name.toLowerCase().endsWith('.zip');

/**
 * Returns films whose upload was begun in this browser and not yet used: [{url, name, size, whole?, refused?}].
 * @returns {Unfinished[]}
 */
export function unfinishedFilms() {
  return Object.keys(localStorage)
    .filter((key) => key.startsWith(REMEMBERED))
    .map((key) => ({ key, ...recall(key, /** @type {Omit<Unfinished, 'key'>} */ ({})) }))
    .filter((upload) => upload.url && !isArchive(upload));
}

/** Removes an unfinished upload here and on the server. @param {Unfinished} upload */
export async function discardUpload({ key, url }) {
  remember(key, null);
  await send('DELETE', url, { headers: TUS, allow: [404, 410] });
}

/** Events: `change` after every piece and every change of state. */
export class Upload extends EventTarget {
  /** @type {'IDLE'|'SENDING'|'WAITING'|'PAUSED'|'DONE'|'FAILED'|'CANCELLED'} */
  state = 'IDLE';
  offset = 0;
  /** Bytes a second, averaged over the last pieces; 0 until known. */
  speed = 0;
  /** A sentence that says why it failed, or what it is waiting for. @type {string|null} */
  reason = null;

  #file;
  #path;
  #key;
  /** @type {string|null} */
  #url = null;
  #stop = new AbortController();

  /**
   * @param {File} file
   * @param {string} path distinguishes it from a file of the same name in another folder
   */
  constructor(file, path) {
    super();
    this.#file = file;
    this.#path = path;
    this.#key = keyOf(file, path);
    this.#url = recall(this.#key, /** @type {Partial<Unfinished>} */ ({})).url ?? null;
  }

  get size() {
    return this.#file.size;
  }

  /** Seconds left, or null while unknown. */
  get etaS() {
    return this.speed ? (this.size - this.offset) / this.speed : null;
  }

  /** The server's id of the finished upload. */
  get id() {
    return this.#url?.split('/').pop() ?? null;
  }

  /** Sends what is missing; returns when it is done, paused, cancelled or failed. */
  async start() {
    this.#stop = new AbortController();
    this.#become('SENDING');
    let failures = 0;
    while (this.state === 'SENDING' || this.state === 'WAITING') {
      try {
        await this.#locate();
        while (this.offset < this.size) {
          await this.#sendPiece();
          failures = 0;
        }
        this.#remember({ whole: true });
        this.#become('DONE');
      } catch (error) {
        if (!refusalIn(error)) return;
        if (!this.#canGoOn(error)) {
          this.#become('FAILED', errorText(error));
          return;
        }
        this.#become('WAITING', errorText(error));
        await pause(PAUSES_S[Math.min(failures, PAUSES_S.length - 1)], this.#stop.signal);
        failures += 1;
      }
    }
  }

  pause() {
    this.#become('PAUSED');
    this.#stop.abort();
  }

  /** Stops and deletes what has arrived. */
  async cancel() {
    this.#become('CANCELLED');
    this.#stop.abort();
    const url = this.#url;
    this.forget();
    if (url) await send('DELETE', url, { headers: TUS, allow: [404, 410, 423] });
  }

  /** The upload has been used: choosing the file again starts a new one. */
  forget() {
    remember(this.#key, null);
  }

  /**
   * Records why the server rejects the file: a file that is no film is deleted; with another rig it may be
   * accepted, so it stays.
   * @param {{code: string, reason: string}} refusal
   */
  async reject({ code, reason }) {
    if (code !== 'unreadable_video') {
      this.#remember({ refused: reason });
      return;
    }
    const url = this.#url;
    this.forget();
    this.#url = null;
    this.offset = 0;
    this.#become('FAILED', reason);
    await send('DELETE', url, { headers: TUS, allow: [404, 410] });
  }

  /** @param {{whole?: boolean, refused?: string}} outcome */
  #remember(outcome = {}) {
    const kept = { url: this.#url, name: this.#path, size: this.size, ...outcome };
    remember(this.#key, kept);
  }

  /** @param {ApiError} error */
  #canGoOn(error) {
    if (this.#url && (error.status === 404 || error.status === 410)) {
      this.#url = null; // the server has deleted it: start again
      this.forget();
      return true;
    }
    // A full disk (507) may never have room for the video: a person decides what to delete.
    if (error.status === 507) return false;
    return error.isTemporary || error.status === 409 || error.status === 460;
  }

  /** Finds the upload on the server, or creates it; sets the offset. */
  async #locate() {
    const { signal } = this.#stop;
    if (this.#url) {
      const response = await send('HEAD', this.#url, { headers: TUS, signal });
      this.#advance(Number(response.headers.get('Upload-Offset')));
      return;
    }
    const name = new TextEncoder().encode(this.#file.name);
    const response = await send('POST', CREATION, {
      headers: {
        ...TUS,
        'Upload-Length': String(this.size),
        'Upload-Metadata': `filename ${btoa(String.fromCharCode(...name))}`,
      },
      signal,
    });
    this.#url = new URL(response.headers.get('Location'), location.href).pathname;
    this.#remember();
    this.#advance(0);
  }

  async #sendPiece() {
    const piece = await this.#read(this.offset, this.offset + this.#pieceLength());
    const begun = performance.now();
    const response = await send('PATCH', this.#url, {
      headers: {
        ...TUS,
        'Content-Type': 'application/offset+octet-stream',
        'Upload-Offset': String(this.offset),
        ...(await checksum(piece)),
      },
      body: piece,
      signal: this.#stop.signal,
    });
    const offset = Number(response.headers.get('Upload-Offset'));
    if (!(offset > this.offset)) {
      throw new ApiError(500, 'no_progress', 'The server did not take the last piece.');
    }
    const speed = ((offset - this.offset) / Math.max(performance.now() - begun, 1)) * 1000;
    this.speed = this.speed ? 0.7 * this.speed + 0.3 * speed : speed;
    this.#advance(offset);
  }

  /**
   * Returns bytes of the file, which may have been on a disk that is no longer there.
   * @param {number} from
   * @param {number} to
   */
  async #read(from, to) {
    try {
      return await this.#file.slice(from, to).arrayBuffer();
    } catch (error) {
      if (!(error instanceof DOMException)) throw error;
      throw new ApiError(400, 'file_unreadable', t('films.unreadable'));
    }
  }

  /**
   * Returns about a second's worth of bytes, so that the progress moves: fetch reports none while sending.
   */
  #pieceLength() {
    return Math.round(Math.min(Math.max(this.speed, SMALLEST_PIECE), LARGEST_PIECE));
  }

  /** @param {number} offset */
  #advance(offset) {
    this.offset = offset;
    if (this.state === 'WAITING') this.#become('SENDING');
    else this.dispatchEvent(new Event('change'));
  }

  /** @param {Upload['state']} state @param {string|null} [reason] */
  #become(state, reason = null) {
    this.state = state;
    this.reason = reason;
    this.dispatchEvent(new Event('change'));
  }
}

/**
 * Returns the checksum header; `crypto.subtle` exists only over https and on localhost, elsewhere it is
 * left out.
 * @param {ArrayBuffer} piece
 */
async function checksum(piece) {
  if (!globalThis.crypto?.subtle) return {};
  const digest = await crypto.subtle.digest('SHA-256', piece);
  return { 'Upload-Checksum': `sha256 ${btoa(String.fromCharCode(...new Uint8Array(digest)))}` };
}
