/** A person's settings of the strips, stored in this browser. */

import { recallMembers, remember } from '../../../core/page/remembered.js';
import { Store } from '../../../core/page/store.js';

const KEY = 'chainage.strips';
const USUAL = {
  lanes: ['defects', 'joints', 'counter', 'quality', 'speed', 'health', 'wall'],
  /** Effect of a click on the unrolled wall: 'tag' or 'seek'. */
  click: 'tag',
};

/** A store of {lanes, click}, shared by all strips. */
class StripSettings extends Store {
  constructor() {
    super(recallMembers(KEY, USUAL));
  }

  has(lane) {
    return this.value.lanes.includes(lane);
  }

  keep(changes) {
    const value = { ...this.value, ...changes };
    remember(KEY, value);
    this.set(value);
  }
}

export const stripSettings = new StripSettings();
