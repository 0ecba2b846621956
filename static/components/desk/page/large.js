/** One part of the desk over the whole window, and over the whole screen where the browser allows it. */

import { Store } from '../../../core/page/store.js';

/** Holds 'film', 'viewer', or null when all parts are shown. */
export class Large extends Store {
  /** @param {AbortSignal} signal */
  constructor(signal) {
    super(null);
    document.addEventListener('fullscreenchange', () => document.fullscreenElement || this.set(null), { signal });
  }

  toggle(part) {
    if (this.value === part) {
      this.leave();
      return;
    }
    this.set(part);
    // Where the screen is refused, as in some tablets, the window has to do.
    if (!document.fullscreenElement) document.documentElement.requestFullscreen?.().catch(console.warn);
  }

  leave() {
    this.set(null);
    if (document.fullscreenElement) document.exitFullscreen();
  }
}
