/**
 * Players that draw the pictures of an inspection on one canvas, each with its frame number: from the
 * original file, from single stills, from the running tracker, and none where there is no film.
 *
 * Every player draws a picture and announces its frame in the same step, so that the overlay always matches
 * the picture. `asked` is the frame requested last; while it differs from `frame`, the picture is on its
 * way.
 */

import { blob } from '../../../core/server/api.js';
import { orToast } from '../../shared/toast-stack/toast-stack.js';

/**
 * Shares of a frame's interval to seek to, tried in turn while another frame is shown.
 *
 * Chromium takes the duration of a frame from the decoding order, which with a variable rate and B-frames
 * belongs to another frame (measured with 150): it shows the previous frame for too long. It also learns the
 * true duration only at the end of a file whose header states less, and until then stops before the last
 * frame; another try reaches it. A frame that no try finds is fetched as a single picture.
 */
const SEEK_SHARES = [0.5, 0.5, 0.97];

/** Events: `frame` (a picture was drawn), `state` (`rate` has changed). */
class Player extends EventTarget {
  frame = -1;
  asked = -1;
  /** 0 is stopped, 1 is the speed of the recording, negative runs backwards. */
  rate = 0;

  #canvas;
  #timer = 0;

  constructor(canvas, track) {
    super();
    this.#canvas = canvas;
    this.track = track;
  }

  get isBusy() {
    return this.asked !== this.frame;
  }

  /** Plays at `rate` by requesting one frame after the other; the newest request wins. */
  shuttle(rate) {
    cancelAnimationFrame(this.#timer);
    this.#setRate(rate);
    if (rate === 0) return;
    const [begun, from] = [performance.now(), this.track.row(Math.max(this.asked, 0)).time_s];
    const tick = (now) => {
      const frame = this.track.frameAt(from + (rate * (now - begun)) / 1000);
      if (frame !== this.asked) this.seek(frame);
      const isAtEnd = rate > 0 ? frame === this.track.length - 1 : frame === 0;
      if (isAtEnd) this.#setRate(0);
      else this.#timer = requestAnimationFrame(tick);
    };
    this.#timer = requestAnimationFrame(tick);
  }

  /** Asks for the picture of a frame. @param {number} _frame */
  seek(_frame) {}

  step(count) {
    this.shuttle(0);
    this.seek(this.#clamp((this.asked < 0 ? this.frame : this.asked) + count));
  }

  skip(seconds) {
    this.shuttle(0);
    const from = this.track.row(Math.max(this.asked, 0));
    this.seek(this.track.frameAt(from.time_s + seconds));
  }

  close() {
    cancelAnimationFrame(this.#timer);
  }

  show(picture, width, height, frame) {
    if (this.#canvas.width !== width || this.#canvas.height !== height) {
      this.#canvas.width = width;
      this.#canvas.height = height;
    }
    this.#canvas.getContext('2d').drawImage(picture, 0, 0, width, height);
    this.frame = frame;
    this.dispatchEvent(new Event('frame'));
  }

  #setRate(rate) {
    if (this.rate === rate) return;
    this.rate = rate;
    this.dispatchEvent(new Event('state'));
  }

  #clamp(frame) {
    return Math.min(Math.max(frame, 0), this.track.length - 1);
  }
}

/**
 * The original file by Range requests. A frame is found by seeking to the middle of its interval;
 * the media time identifies the frame on screen. Event `unplayable`: this browser cannot play it.
 */
export class FilePlayer extends Player {
  #video;
  #path;
  #size;
  #sought = -1;
  #missed = 0;
  #end = new AbortController();

  /**
   * @param {string} path of the inspection
   * @param {{width: number, height: number}} size of the picture to draw
   */
  constructor(canvas, track, video, path, size) {
    super(canvas, track);
    this.#video = video;
    this.#path = path;
    this.#size = size;
    video.onseeked = () => {
      if (this.asked !== this.#sought) this.seek(this.asked);
      // The picture of a seek is presented within the next two animation frames.
      else requestAnimationFrame(() => requestAnimationFrame(() => this.#check()));
    };
    video.onended = () => {
      if (this.rate <= 0) return; // a seek to the last picture also ends a film
      this.shuttle(0);
      // A busy machine silently skips the last pictures.
      this.seek(this.track.length - 1);
    };
    video.onerror = () => this.dispatchEvent(new Event('unplayable'));
    video.requestVideoFrameCallback(this.#presented);
    video.src = `${path}/video`;
  }

  #presented = (now, { mediaTime }) => {
    this.#video.requestVideoFrameCallback(this.#presented);
    const [picture, timeS] = snapshot(this.#video, mediaTime);
    const frame = this.track.frameAt(timeS);
    if (this.rate > 0) this.asked = frame;
    // A fresh file shows its first picture before the requested one.
    const mayYetCome = this.#missed < SEEK_SHARES.length - 1;
    const isOnTheWay = this.frame < 0 && frame !== this.asked && mayYetCome;
    if (!isOnTheWay) this.show(picture, this.#size.width, this.#size.height, frame);
    if (picture !== this.#video) picture.close();
    // While tracking runs, the file is longer than the track.
    if (this.rate > 0 && frame === this.track.length - 1) this.shuttle(0);
    if (!this.isBusy) this.#missed = 0;
  };

  seek(frame) {
    this.asked = frame;
    if (this.track.beginsAnew) {
      // A browser has a time axis of its own for such a file.
      this.dispatchEvent(new Event('unplayable'));
      return;
    }
    if (this.#video.seeking) return;
    if (frame !== this.#sought) this.#missed = 0;
    this.#sought = frame;
    this.#video.currentTime = this.track.seekTime(frame, SEEK_SHARES[this.#missed]);
  }

  /** After a seek: tries another share if another frame is shown. */
  #check() {
    if (!this.isBusy || this.asked !== this.#sought || this.#video.seeking) return;
    this.#missed += 1;
    if (this.#missed < SEEK_SHARES.length) this.seek(this.asked);
    else orToast(() => this.#showStill(this.asked));
  }

  async #showStill(frame) {
    const picture = await fetchStill(this.#path, frame, this.#end.signal);
    if (this.asked === frame && this.isBusy) this.show(picture, picture.width, picture.height, frame);
    picture.close();
  }

  shuttle(rate) {
    if (rate > 0) {
      super.shuttle(0);
      this.#video.playbackRate = rate;
      this.rate = rate;
      this.#video.play();
      this.dispatchEvent(new Event('state'));
    } else {
      if (!this.#video.paused) this.#video.pause();
      super.shuttle(rate);
    }
  }

  close() {
    super.close();
    this.#end.abort();
    this.#video.onseeked = this.#video.onended = this.#video.onerror = null;
    this.#video.removeAttribute('src');
    this.#video.load();
  }
}

/**
 * Returns the picture that the video shows and its media time. On a busy machine the video may be one
 * picture ahead of the callback (measured: 2 of 60 while playing); a VideoFrame carries its own time.
 * VideoFrame exists only over https and on localhost; elsewhere playback may be one picture off.
 */
function snapshot(video, mediaTime) {
  if (!('VideoFrame' in globalThis)) return [video, mediaTime];
  const picture = new VideoFrame(video);
  return [picture, picture.timestamp / 1e6];
}

/** Fetches a frame that the server extracted from the original. */
async function fetchStill(path, frame, signal) {
  return createImageBitmap(await blob(`${path}/frames/${frame}.jpg`, signal));
}

/** Single pictures made by the server, for files that no browser plays. */
export class StillPlayer extends Player {
  #path;
  #end = new AbortController();
  #isLoading = false;

  /** @param {string} path of the inspection */
  constructor(canvas, track, path) {
    super(canvas, track);
    this.#path = path;
  }

  seek(frame) {
    this.asked = frame;
    if (!this.#isLoading) orToast(() => this.#load());
  }

  close() {
    super.close();
    this.#end.abort();
  }

  async #load() {
    this.#isLoading = true;
    try {
      while (this.isBusy && !this.#end.signal.aborted) {
        const frame = this.asked;
        const picture = await fetchStill(this.#path, frame, this.#end.signal);
        this.show(picture, picture.width, picture.height, frame);
        picture.close();
      }
    } catch (error) {
      this.shuttle(0); // the next picture would fail, too
      throw error;
    } finally {
      this.#isLoading = false;
    }
  }
}

/** Shows no pictures, for a survey that was imported without its film: frames have only numbers. */
export class BlankPlayer extends Player {
  seek(frame) {
    this.asked = frame;
    this.frame = frame;
    this.dispatchEvent(new Event('frame'));
  }
}

/** Pictures of the running tracker, each with the pose of its own frame in `row`. */
export class LivePlayer extends Player {
  row = null;
  /** When the camera delivered the picture, by `performance.now`; null for a file. */
  capturedMs = null;

  #feed;
  #size;
  #newest = null;
  #isDrawing = false;
  #end = new AbortController();

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import('../../../core/server/live.js').LiveFeed} feed
   * @param {{width: number, height: number}} size of the picture to draw; pictures may be smaller
   */
  constructor(canvas, feed, size) {
    super(canvas, null);
    this.#feed = feed;
    this.#size = size;
    // A picture came while another player was active: the server waits for its acknowledgement.
    feed.acknowledge(feed.seq);
    feed.addEventListener('message', ({ detail }) => this.#receive(detail), {
      signal: this.#end.signal,
    });
  }

  close() {
    super.close();
    this.#end.abort();
  }

  #receive(message) {
    if (!message.jpeg) {
      this.#feed.acknowledge(message.header.seq);
      return;
    }
    this.#newest = message;
    if (!this.#isDrawing) this.#draw();
  }

  async #draw() {
    this.#isDrawing = true;
    try {
      while (this.#newest && !this.#end.signal.aborted) {
        const { header, jpeg, capturedMs } = this.#newest;
        this.#newest = null;
        const picture = await createImageBitmap(new Blob([jpeg], { type: 'image/jpeg' }));
        if (!this.#end.signal.aborted) {
          this.row = header;
          this.capturedMs = capturedMs;
          this.asked = header.frame;
          this.show(picture, this.#size.width, this.#size.height, header.frame);
        }
        picture.close();
        this.#feed.acknowledge(header.seq);
      }
    } finally {
      this.#isDrawing = false;
    }
  }
}
