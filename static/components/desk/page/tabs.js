/** The tabs beside the film, in their order: [name, element]. A panel uses the desk of the page. */

import { wordFor } from '../../../core/page/words.js';
import '../panels/checks-panel.js';
import '../../distance/corrections/corrections-panel.js';
import '../../defects/defect-list/defect-list.js';
import '../../defects/finding-queue/finding-queue.js';
import '../header/header-panel.js';
import '../panels/history-panel.js';
import '../panels/review-panel.js';

const PANELS = [
  ['defects', 'defect-list'],
  ['findings', 'finding-queue'],
  ['header', 'header-panel'],
  ['corrections', 'corrections-panel'],
  ['checks', 'checks-panel'],
  ['review', 'review-panel'],
  ['history', 'history-panel'],
];

export const TABS = PANELS.map(([name, element]) => ({ name, element, title: wordFor('tab', name) }));
