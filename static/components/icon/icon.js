/** The icons of the page, drawn on a 20 x 20 grid. */

import { html } from '../../core/html.js';

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
  keys: html`<rect x="2" y="5" width="16" height="10.500" rx="2" /><path d="M5 8.500h.1M8.300 8.500h.1M11.600 8.500h.1M15 8.500h.1M6 12h8" />`,
  film: html`<rect x="2.500" y="4" width="15" height="12" rx="1.500" /><path d="M6.500 4v12M13.500 4v12M2.500 8h4M2.500 12h4M13.500 8h4M13.500 12h4" />`,
  leave: html`<path d="M8 3.500H4v13h4M12.500 6.500L16 10l-3.500 3.500M16 10H8" />`,
  back: html`<path d="M12.500 4.500L7 10l5.500 5.500" />`,
};

/** @param {keyof typeof SHAPES} name */
export const icon = (name) =>
  html`<svg class="icon" viewBox="0 0 20 20" aria-hidden="true" focusable="false">${SHAPES[name]}</svg>`;
