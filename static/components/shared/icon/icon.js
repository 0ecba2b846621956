/** The icons of the page, drawn on a 20 x 20 grid. */

import { html } from '../../../core/page/html.js';

const SHAPES = {
  logo: html`<path d="M2 14a8 8 0 0 1 16 0M5.5 14a4.500 4.500 0 0 1 9 0" /><path d="M2 17h16M6 15.500v3M10 15.500v3M14 15.500v3" />`,
  play: html`<path class="solid" d="M6 3.500v13l10.500-6.500z" />`,
  pause: html`<path class="solid" d="M5 4h3.500v12H5zM11.500 4H15v12h-3.500z" />`,
  stepBack: html`<path class="solid" d="M15 4v12l-8-6z" /><path d="M5 4.500v11" />`,
  stepForward: html`<path class="solid" d="M5 4v12l8-6z" /><path d="M15 4.500v11" />`,
  live: html`<circle class="solid" cx="10" cy="10" r="3" /><path d="M5.500 5.500a6.400 6.400 0 0 0 0 9M14.500 5.500a6.400 6.400 0 0 1 0 9" />`,
  plus: html`<path d="M10 4v12M4 10h12" />`,
  close: html`<path d="M5 5l10 10M15 5L5 15" />`,
  check: html`<path d="M4 10.500l4 4 8-9" />`,
  alert: html`<path d="M10 3L18 17H2zM10 8.500v4M10 14.800v.1" />`,
  info: html`<circle cx="10" cy="10" r="7.500" /><path d="M10 9v5M10 6.200v.1" />`,
  wait: html`<circle cx="10" cy="10" r="7.500" /><path d="M10 5.500V10l3 2" />`,
  stop: html`<circle cx="10" cy="10" r="7.500" /><path d="M5 15L15 5" />`,
  retry: html`<path d="M15.500 7A6.500 6.500 0 1 0 16.500 11M16 3v4h-4" />`,
  download: html`<path d="M10 3v9.500M6 9l4 4 4-4M3.500 16.500h13" />`,
  upload: html`<path d="M10 13V3.500M6 7l4-4 4 4M3.500 16.500h13" />`,
  edit: html`<path d="M4 16l1-4 8.500-8.500 3 3L8 15z" />`,
  trash: html`<path d="M4 5.500h12M8 5.500V3.500h4v2M5.500 5.500l.8 11h7.400l.8-11" />`,
  undo: html`<path d="M4 8h8a4.500 4.500 0 0 1 0 9H8M7.500 4L4 8l3.500 4" />`,
  redo: html`<path d="M16 8H8a4.500 4.500 0 0 0 0 9h4M12.500 4L16 8l-3.500 4" />`,
  link: html`<path d="M8.500 11.500a3 3 0 0 0 4.200 0l3-3a3 3 0 0 0-4.200-4.200l-1 1M11.500 8.500a3 3 0 0 0-4.200 0l-3 3a3 3 0 0 0 4.200 4.200l1-1" />`,
  move: html`<path d="M10 2.500v15M2.500 10h15M7.500 5L10 2.500 12.500 5M7.500 15l2.500 2.500 2.500-2.500M5 7.500L2.500 10 5 12.500M15 7.500l2.500 2.500-2.500 2.500" />`,
  stretch: html`<path d="M3 5v10M17 5v10M3 10h14" /><path class="solid" d="M5.500 7.500v5h9v-5z" />`,
  newest: html`<path d="M4 5.500h7M4 10h7M4 14.500h4M15 15.500v-11M12.500 7L15 4.500 17.500 7" />`,
  voice: html`<rect x="7.500" y="2.500" width="5" height="9" rx="2.500" /><path d="M4.500 9.500a5.500 5.500 0 0 0 11 0M10 15v2.500M7 17.500h6" />`,
  keys: html`<rect x="2" y="5" width="16" height="10.500" rx="2" /><path d="M5 8.500h.1M8.300 8.500h.1M11.600 8.500h.1M15 8.500h.1M6 12h8" />`,
  film: html`<rect x="2.500" y="4" width="15" height="12" rx="1.500" /><path d="M6.500 4v12M13.500 4v12M2.500 8h4M2.500 12h4M13.500 8h4M13.500 12h4" />`,
  network: html`<path d="M3 8.200a10 10 0 0 1 14 0M5.800 11.200a6 6 0 0 1 8.400 0" /><circle class="solid" cx="10" cy="14.500" r="1.600" />`,
  video: html`<path d="M2.500 5.500h10.500v9H2.500zM13 9l4.500-2.500v7L13 11" />`,
  leave: html`<path d="M8 3.500H4v13h4M12.500 6.500L16 10l-3.500 3.500M16 10H8" />`,
  menu: html`<path d="M3.500 5.500h13M3.500 10h13M3.500 14.500h13" />`,
  settings: html`<path d="M3 6h7M14 6h3M3 14h3M10 14h7" /><circle cx="12" cy="6" r="2" /><circle cx="8" cy="14" r="2" />`,
  help: html`<circle cx="10" cy="10" r="7.500" /><path d="M7.700 7.800a2.400 2.400 0 1 1 3.400 2.200c-.800.400-1.100.900-1.100 1.700M10 14.200v.1" />`,
  table: html`<rect x="2.500" y="4" width="15" height="12" rx="1" /><path d="M2.500 8h15M2.500 12h15M8 4v12" />`,
  search: html`<circle cx="8.500" cy="8.500" r="5" /><path d="M12.500 12.500l4 4" />`,
  map: html`<path d="M10 17.500c-3.700-3.500-5.500-6.400-5.500-9a5.500 5.500 0 0 1 11 0c0 2.600-1.800 5.500-5.500 9z" /><circle cx="10" cy="8.500" r="2" />`,
  layers: html`<path d="M10 3l7.500 4-7.500 4-7.500-4zM3.500 10.500L10 14l6.500-3.500M3.500 13.800L10 17.300l6.500-3.500" />`,
  minus: html`<path d="M4 10h12" />`,
  whole: html`<path d="M2.500 5v10M17.500 5v10M5 10h10M7.500 7.500L5 10l2.500 2.500M12.500 7.500L15 10l-2.500 2.500" />`,
  swap: html`<path d="M3.500 7h11M11.500 4l3 3-3 3M16.500 13h-11M8.500 10l-3 3 3 3" />`,
  ruler: html`<path d="M2.500 13L13 2.500l4.500 4.500L7 17.500zM6 9.500l2 2M8.500 7l1.500 1.500M11 4.500l2 2" />`,
  folder: html`<path d="M2.500 4.500h5.500l2 2.500h7.500v9h-15z" />`,
  label: html`<path d="M3.500 3.500h6l7 7-6 6-7-7z" /><circle class="solid" cx="7" cy="7" r="1.200" />`,
  flag: html`<path d="M5 17.500V3h10l-2.500 3.500L15 10H5" />`,
  people: html`<circle cx="7.500" cy="7" r="3" /><path d="M2 16.500a5.500 5.500 0 0 1 11 0M13 4.300a3 3 0 0 1 0 5.400M15 11.800a5.500 5.500 0 0 1 3 4.700" />`,
  lock: html`<rect x="4.500" y="9" width="11" height="7.500" rx="1.500" /><path d="M7 9V6.500a3 3 0 0 1 6 0V9" />`,
  forward: html`<path d="M7.500 4.500L13 10l-5.500 5.500" />`,
  contrast: html`<circle cx="10" cy="10" r="7.500" /><path class="solid" d="M10 2.500a7.500 7.500 0 0 1 0 15z" />`,
  large: html`<path d="M3 7.500V3h4.500M12.500 3H17v4.500M17 12.500V17h-4.500M7.500 17H3v-4.500" />`,
  window: html`<path d="M8 4.500H3v12h12v-5M11 3h6v6M17 3l-7.500 7.500" />`,
  small: html`<path d="M7.500 3v4.500H3M17 7.500h-4.500V3M12.500 17v-4.500H17M3 12.500h4.500V17" />`,
  back: html`<path d="M12.500 4.500L7 10l5.500 5.500" />`,
};

/** @typedef {keyof typeof SHAPES} IconName */

/** @param {IconName} name */
export const icon = (name) =>
  html`<svg class="icon" viewBox="0 0 20 20" aria-hidden="true" focusable="false">${SHAPES[name]}</svg>`;
