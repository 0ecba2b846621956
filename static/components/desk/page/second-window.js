/** One part of the desk in a window of its own: the 3D view or the unrolled wall, with the distance. */

import { listenTo } from '../../../core/page/store.js';
import { html, render } from '../../../core/page/html.js';
import { bindKeys } from '../../../core/page/keys.js';
import { chainage } from '../../../core/wall/units.js';
import { t } from '../../../core/page/words.js';
import { showSaving } from '../frame/saving.js';
import { bindZoom, zoomAxis, zoomTools } from '../../distance/strip/zoom-tools.js';
import './conflict-notice.js';
import '../../distance/readout/distance-readout.js';
import './lock-notice.js';
import '../../film/views/viewer-panel.js';
import '../../film/views/wall-strip.js';

const ACKNOWLEDGED_AFTER_MS = 500;

const TITLES = { viewer: t('viewer.title'), wall: t('wall.label') };

/**
 * Fills the page with one part.
 * @param {import('./inspection-page.js').InspectionPage} page
 * @param {'viewer'|'wall'} part
 * @returns {Record<string, HTMLElement>} its parts, with `messages`
 */
export function buildWindow(page, part) {
  const { desk, signal } = page;
  const { name } = desk.inspection.value;
  document.title = `${TITLES[part]} · ${name}`;
  page.dataset.window = part;
  const parts = render(
    page,
    html`<main id="main" class="second" tabindex="-1">
        <header class="second__head row gap-3"><h1 class="second__name one-line grow">${name}<span class="dim"> · ${TITLES[part]}</span></h1>
          ${part === 'wall' && html`<div class="second__tools" role="group" aria-label="${t('strip.title')}">${zoomTools()}</div>`}
          <p class="save small dim number" role="status" data-part="save" data-needs="operator"></p></header>
        <distance-readout class="panel"></distance-readout>
        ${part === 'wall' ? html`<wall-strip class="second__part grow panel"></wall-strip>` : html`<viewer-panel class="second__part grow panel"></viewer-panel>`}
        <conflict-notice hidden></conflict-notice>
        <div class="desk-messages stack" data-part="messages"></div>
        <lock-notice hidden></lock-notice>
      </main>`,
  );
  showSaving(parts.save, desk, signal);
  if (part === 'wall') bindZoom(parts, desk, signal);
  // The film is on the desk: here a few messages a second are enough for what changes with a run.
  listenTo(desk.live, 'message', signal, ({ detail: { header } }) => {
    setTimeout(() => desk.live.acknowledge(header.seq), ACKNOWLEDGED_AFTER_MS);
  });
  listenTo(desk, 'tagged', signal, ({ detail }) =>
    desk.done(t('desk.tagged_point', { where: chainage(detail.distance_m) })),
  );
  bindKeys(
    document,
    [
      { keys: ['u', 'Ctrl+z'], run: () => page.undo() },
      { keys: ['Shift+u', 'Ctrl+Shift+z', 'Ctrl+y'], run: () => page.redo() },
      { keys: ['Escape'], run: () => desk.picking.set(null) },
      ...(part === 'wall' ? zoomKeys(desk) : []),
    ],
    signal,
  );
  return parts;
}

const zoomKeys = (desk) => [
  { keys: ['+', '='], run: () => zoomAxis(desk, 1) },
  { keys: ['-'], run: () => zoomAxis(desk, -1) },
  { keys: ['0'], run: () => desk.axis.showWhole() },
];
