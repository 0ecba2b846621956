/** The button that gives a part of the desk a window of its own, and brings it back. */

import { html, render } from '../../../core/page/html.js';
import { t } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';

const WORDS = {
  viewer: { open: t('window.viewer'), back: t('window.viewer_back') },
  wall: { open: t('window.wall'), back: t('window.wall_back') },
};

/**
 * Follows whether the part is in its own window; in such a window itself there is no button.
 * @param {HTMLButtonElement} button
 * @param {Desk} desk
 * @param {'viewer'|'wall'} part
 * @param {AbortSignal} signal
 */
export function windowButton(button, desk, part, signal) {
  button.hidden = desk.windows === null;
  if (button.hidden) return;
  const show = () => {
    const isAway = desk.windows.has(part);
    const words = isAway ? WORDS[part].back : WORDS[part].open;
    render(button, html`${icon(isAway ? 'small' : 'window')}`);
    button.setAttribute('aria-label', words);
    button.title = words;
  };
  button.addEventListener('click', () => desk.windows.toggle(part) || desk.fault(t('window.blocked')), { signal });
  desk.windows.addEventListener('change', show, { signal });
  show();
}
