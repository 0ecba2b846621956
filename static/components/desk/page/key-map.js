/** Every key of the inspection page, in the groups of the help. */

import { may, mayEdit } from '../../../core/page/rights.js';
import { chainage } from '../../../core/wall/units.js';
import { t, withinSentence } from '../../../core/page/words.js';
import { addPhoto } from '../../defects/attachments/actions.js';
import { GRADES } from '../../shared/severity-mark/severity-mark.js';
import { goToQuestion } from '../panels/remarks.js';
import { quickCodes } from '../../film/video/quick-codes.js';
import { copyLink } from '../actions/links.js';
import { HERE_M, changeStretch, finishStretch, startStretch } from '../actions/stretches.js';

/** Directions in which the keys move an enlarged picture: across and down. */
const PAN = {
  'Ctrl+ArrowLeft': [-1, 0],
  'Ctrl+ArrowRight': [1, 0],
  'Ctrl+ArrowUp': [0, -1],
  'Ctrl+ArrowDown': [0, 1],
};

/**
 * @param {import('./inspection-page.js').InspectionPage} page
 * @returns {{title: string, bindings: import('../../../core/page/keys.js').Binding[]}[]}
 */
export function keyMap(page) {
  const isAllowed = (/** @type {any} */ { needs = 'viewer' }) => (needs === 'operator' ? mayEdit() : may(needs));
  return [tagKeys(page), playKeys(page), defectKeys(page), findingKeys(page), stripKeys(page), helpKeys(page)]
    .filter(isAllowed)
    .map(({ title, bindings }) => ({ title, bindings: bindings.filter(isAllowed) }));
}

/** While the findings are beside the film, these letters are theirs. */
const findingKeys = (page, { desk } = page) => {
  const when = () => desk.tab.value === 'findings' && !desk.large.value;
  const run = (/** @type {'accept'|'reject'|'next'} */ what) => () => page.querySelector('finding-queue')[what]();
  return {
    title: t('keys.findings'),
    bindings: [
      { keys: ['a'], needs: 'operator', when, label: t('findings.accept'), run: run('accept') },
      { keys: ['r'], needs: 'operator', when, label: t('findings.reject'), run: run('reject') },
      { keys: ['n'], when, label: t('findings.next'), run: run('next') },
    ],
  };
};

const tagKeys = (page, { desk, video } = page) => ({
  title: t('keys.tag'),
  needs: 'operator',
  bindings: [
    {
      keys: ['t', 'F13', 'Pause'],
      label: t('keys.tag_middle'),
      // A pedal tags while a form is being filled in too; the form stays open.
      run: ({ target }) => desk.tagCentre({ isSelected: !target.closest?.('defect-form') }),
    },
    ...quickCodes(desk.catalogue).map(({ tag, label }, i) => ({
      keys: [String(i + 1)],
      label: t('keys.tag_as', { code: tag.code, label: withinSentence(label) }),
      run: () => desk.tagAs(quickCodes(desk.catalogue)[i].tag),
    })),
    { keys: ['b'], shown: ['B … B A B'], label: t('keys.chain'), run: () => video.typeCode('b') },
    { keys: ['a'], shown: ['A … A E D'], label: t('keys.chain_changes'), run: () => video.typeCode('a') },
    { keys: ['r'], label: t('keys.repeat'), run: () => desk.repeatLast() },
    { keys: ['s'], label: t('keys.stretch', { reach: chainage(HERE_M) }), run: () => startStretch(desk) },
    { keys: ['c'], label: t('keys.stretch_change'), run: () => changeStretch(desk) },
    { keys: ['f'], label: t('keys.stretch_finish'), run: () => finishStretch(desk) },
    { keys: ['u', 'Ctrl+z'], label: t('keys.undo'), run: () => page.undo() },
    {
      keys: ['Shift+u', 'Ctrl+Shift+z', 'Ctrl+y'],
      label: t('keys.redo'),
      run: () => page.redo(),
    },
  ],
});

const playKeys = (page, { desk, video, strip } = page) => ({
  title: t('keys.play'),
  bindings: [
    { keys: [' '], label: t('keys.toggle'), run: () => video.togglePlay() },
    { keys: ['ArrowLeft'], label: t('keys.back_frame'), run: () => video.step(-1) },
    { keys: ['ArrowRight'], label: t('keys.forward_frame'), run: () => video.step(1) },
    { keys: ['Shift+ArrowLeft'], label: t('keys.back_second'), run: () => video.skip(-1) },
    { keys: ['Shift+ArrowRight'], label: t('keys.forward_second'), run: () => video.skip(1) },
    { keys: ['j'], label: t('keys.backwards'), run: () => video.shuttle(-1) },
    { keys: ['k'], label: t('keys.still'), run: () => video.shuttle(0) },
    { keys: ['l'], label: t('keys.forwards'), run: () => video.shuttle(1) },
    { keys: ['<'], label: t('keys.slower'), run: () => video.changeSpeed(-1) },
    { keys: ['>'], label: t('keys.faster'), run: () => video.changeSpeed(1) },
    { keys: ['i'], label: t('video.zoom_in'), run: () => video.zoom(1) },
    { keys: ['o'], label: t('video.zoom_out'), run: () => video.zoom(-1) },
    { keys: ['w'], label: t('video.whole'), run: () => video.showWhole() },
    {
      keys: Object.keys(PAN),
      shown: ['Ctrl + ← → ↑ ↓'],
      label: t('keys.pan'),
      run: (event, key) => video.pan(...PAN[key]),
    },
    { keys: ['Shift+f'], label: t('video.large'), run: () => desk.large.toggle('film') },
    { keys: ['g'], label: t('strip.go_to'), run: () => strip.goTo() },
    { keys: ['z'], needs: 'operator', label: t('corrections.zero_here'), run: () => page.setZero() },
    { keys: ['Home'], label: t('keys.first'), run: () => video.seek(0) },
    { keys: ['End'], label: t('keys.last'), run: () => video.seek(desk.track.length - 1) },
  ],
});

const defectKeys = (page, { desk } = page) => ({
  title: t('keys.defects'),
  bindings: [
    { keys: ['n'], label: t('keys.next'), run: () => desk.goToNeighbour(1) },
    { keys: ['p'], label: t('keys.previous'), run: () => desk.goToNeighbour(-1) },
    { keys: ['q'], label: t('reviewing.next'), run: () => goToQuestion(desk) },
    { keys: ['v'], needs: 'operator', label: t('keys.complete'), run: () => desk.askAll() },
    { keys: ['e', 'Enter'], label: t('keys.edit'), run: () => page.edit() },
    {
      keys: GRADES.map((grade) => `Shift+${grade}`),
      shown: ['Shift + 0 … 5'],
      needs: 'operator',
      label: t('keys.severity'),
      run: (event, key) => page.rate(Number(key.at(-1))),
    },
    {
      keys: ['Shift+m'],
      needs: 'operator',
      label: t('measure.start_help'),
      run: () => desk.measuring.startSelected(),
    },
    { keys: ['m'], needs: 'operator', label: t('keys.move'), run: () => desk.moveHere() },
    { keys: ['Shift+p'], needs: 'operator', label: t('attach.add_photo'), run: () => addPhoto(desk) },
    { keys: ['y'], label: t('link.copy'), run: () => copyLink(desk) },
    {
      keys: ['Delete', 'Backspace'],
      needs: 'operator',
      label: t('keys.delete'),
      run: () => page.remove(),
    },
    { keys: ['Escape'], label: t('keys.leave'), run: () => page.leave() },
  ],
});

const stripKeys = ({ desk, strip }) => ({
  title: t('strip.title'),
  bindings: [
    { keys: ['+', '='], label: t('strip.zoom_in'), run: () => strip.zoom(1) },
    { keys: ['-'], label: t('strip.zoom_out'), run: () => strip.zoom(-1) },
    { keys: ['0'], label: t('strip.whole'), run: () => desk.axis.showWhole() },
  ],
});

const helpKeys = (page) => ({
  title: t('keys.help'),
  bindings: [{ keys: ['?'], label: t('keys.list'), run: () => page.help() }],
});

/** Keys that move the 3D camera while the 3D view has the focus. */
export const VIEWER_KEYS = new Set(['w', 'a', 's', 'd', 'q', 'e', 'ArrowLeft', 'ArrowRight', 'ArrowUp', 'ArrowDown']);
