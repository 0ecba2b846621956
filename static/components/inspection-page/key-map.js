/** Every key of the inspection page, in the groups that the help shows. */

import { QUICK_CODES } from '../video-panel/quick-codes.js';

/**
 * @param {object} page the inspection page: `desk`, `video`, `undo`, `remove`, `edit`, `help`
 * @returns {{title: string, bindings: import('../../core/keys.js').Binding[]}[]}
 */
export function keyMap(page) {
  const { desk, video } = page;
  const last = () => desk.track.length - 1;
  return [
    {
      title: 'Tag',
      bindings: [
        { keys: ['t'], shown: ['T'], label: 'Tag the middle of the picture', run: () => desk.tagCentre() },
        ...QUICK_CODES.map(({ code, label }, i) => ({
          keys: [String(i + 1)],
          label: `Tag as ${code} ${label.toLowerCase()}`,
          run: () => desk.tagCentre(code),
        })),
        { keys: ['u', 'Ctrl+z'], shown: ['U', 'Ctrl + Z'], label: 'Undo the last change', run: () => page.undo() },
      ],
    },
    {
      title: 'Play',
      bindings: [
        { keys: [' '], shown: ['Space'], label: 'Play or pause', run: () => video.togglePlay() },
        { keys: ['ArrowLeft'], shown: ['←'], label: 'Back one frame', run: () => video.step(-1) },
        { keys: ['ArrowRight'], shown: ['→'], label: 'Forward one frame', run: () => video.step(1) },
        { keys: ['Shift+ArrowLeft'], shown: ['Shift + ←'], label: 'Back one second', run: () => video.skip(-1) },
        { keys: ['Shift+ArrowRight'], shown: ['Shift + →'], label: 'Forward one second', run: () => video.skip(1) },
        { keys: ['j'], shown: ['J'], label: 'Play backwards, again: faster', run: () => video.shuttle(-1) },
        { keys: ['k'], shown: ['K'], label: 'Stand still', run: () => video.shuttle(0) },
        { keys: ['l'], shown: ['L'], label: 'Play forwards, again: faster', run: () => video.shuttle(1) },
        { keys: ['Home'], label: 'First frame', run: () => video.seek(0) },
        { keys: ['End'], label: 'Last frame', run: () => video.seek(last()) },
      ],
    },
    {
      title: 'Defects',
      bindings: [
        { keys: ['n'], shown: ['N'], label: 'Next defect', run: () => desk.goToNeighbour(1) },
        { keys: ['p'], shown: ['P'], label: 'Defect before', run: () => desk.goToNeighbour(-1) },
        { keys: ['e'], shown: ['E'], label: 'Edit the selected defect', run: () => page.edit() },
        { keys: ['Delete', 'Backspace'], shown: ['Del'], label: 'Delete the selected defect', run: () => page.remove() },
        { keys: ['Escape'], shown: ['Esc'], label: 'Close the form, then drop the selection', run: () => page.leave() },
      ],
    },
    {
      title: 'Help',
      bindings: [{ keys: ['?'], label: 'This list', run: () => page.help() }],
    },
  ];
}

/** Keys that move the 3D camera while the 3D view has the focus. */
export const VIEWER_KEYS = new Set([
  'w', 'a', 's', 'd', 'q', 'e', 'ArrowLeft', 'ArrowRight', 'ArrowUp', 'ArrowDown',
]);
