/** Templates of reports: on the server, and one that is being edited. */

import { get, put, remove } from '../server/api.js';

const TEMPLATES = '/api/report-templates';
/** Steps that can be undone. */
const MOST_STEPS = 100;

/**
 * @typedef {Api['ReportTemplate']} Template
 * @typedef {Api['Recommendation']} Block
 * @typedef {{name: Template['sections'][number], isOn: boolean}} Section
 * @typedef {Omit<Template, 'sections'> & {sections: Section[]}} Form
 * @typedef {Api['ReportTemplateOut']} Used its project is '' for that of all others, null for the defaults
 */

/** @type {Template['sections']} */
const SECTIONS = [
  'summary',
  'header',
  'graphic',
  'observations',
  'photos',
  'wall',
  'scene',
  'condition',
  'measurement',
  'checks',
];

/** @param {string} project */
const pathOf = (project) => `${TEMPLATES}/${encodeURIComponent(project)}`;

/**
 * Returns the projects that have a template; '' is all others. @returns {Promise<string[]>}
 * @param {AbortSignal} [signal]
 */
export async function projectsWithTemplate(signal) {
  /** @type {Api['ReportTemplatesOut']} */
  const { templates } = await get(TEMPLATES, signal);
  return templates.map(({ project }) => project);
}

/** @returns {Promise<Used>} @param {string} project @param {AbortSignal} [signal] */
export const loadTemplate = (project, signal) => get(pathOf(project), signal);

/**
 * Stores the template of a project, unless the project no longer uses `version`; null replaces any.
 * @param {string} project
 * @param {Template} template
 * @param {string|null} [version]
 * @returns {Promise<Used>}
 */
export const saveTemplate = (project, template, version) => put(pathOf(project), template, undefined, version);

/** Takes the own template of a project away. @param {string} project @param {string} [version] */
export const removeTemplate = (project, version) => remove(pathOf(project), undefined, version);

/**
 * A template with all sections in an order of their own, so that one that is switched off keeps its place.
 * @param {Template} template
 * @returns {Form}
 */
const toForm = ({ sections, ...rest }) => ({
  ...rest,
  sections: [
    ...sections.map((name) => ({ name, isOn: true })),
    ...SECTIONS.filter((name) => !sections.includes(name)).map((name) => ({ name, isOn: false })),
  ],
});

/** @param {Form} form @returns {Template} */
const toTemplate = ({ sections, ...rest }) => ({
  ...rest,
  sections: sections.filter(({ isOn }) => isOn).map(({ name }) => name),
});

/**
 * Moves one item of a list; returns a new list.
 * @template T
 * @param {T[]} list
 * @param {number} from
 * @param {number} to
 */
export const moved = (list, from, to) => list.toSpliced(from, 1).toSpliced(to, 0, list[from]);

/** A template in a form: fires `change` after every change; each can be undone. */
export class TemplateDraft extends EventTarget {
  #value;
  #stored;
  /** @type {Form[]} */
  #done = [];
  /** @type {Form[]} */
  #undone = [];
  /** @type {unknown} */
  #visit = null;

  /** @param {Template} template as it is stored */
  constructor(template) {
    super();
    this.#value = toForm(template);
    this.#stored = JSON.stringify(template);
  }

  /** The template with its sections as {@link Section}. */
  get value() {
    return this.#value;
  }

  /** What the server gets. @returns {Template} */
  get template() {
    return toTemplate(this.#value);
  }

  get isChanged() {
    return JSON.stringify(sorted(this.template)) !== JSON.stringify(sorted(JSON.parse(this.#stored)));
  }

  /** Whether the last change was typed: then the form shows it already. */
  get isTyped() {
    return this.#visit !== null;
  }

  get canUndo() {
    return this.#done.length > 0;
  }

  get canRedo() {
    return this.#undone.length > 0;
  }

  /**
   * @param {Partial<Form>} fields those that change
   * @param {unknown} [visit] what is typed in one visit of a field is one step
   */
  change(fields, visit = null) {
    if (visit === null || visit !== this.#visit) this.#done.push(this.#value);
    if (this.#done.length > MOST_STEPS) this.#done.shift();
    this.#visit = visit;
    this.#undone = [];
    this.#set({ ...this.#value, ...fields });
  }

  undo() {
    this.#move(this.#done, this.#undone);
  }

  redo() {
    this.#move(this.#undone, this.#done);
  }

  /** Notes that a template is stored now; the steps stay. @param {Template} template */
  keep(template) {
    this.#stored = JSON.stringify(template);
    this.dispatchEvent(new Event('change'));
  }

  /** @param {Form[]} from @param {Form[]} to */
  #move(from, to) {
    if (from.length === 0) return;
    to.push(this.#value);
    this.#visit = null;
    this.#set(from.pop());
  }

  /** @param {Form} value */
  #set(value) {
    this.#value = value;
    this.dispatchEvent(new Event('change'));
  }
}

/** @param {object} template */
const sorted = (template) => Object.entries(template).sort(([a], [b]) => (a < b ? -1 : 1));

/**
 * Contrast of a colour such as #1d3b50 on white paper (WCAG 2.2), as in app/reports/template.py.
 * @param {string} colour
 */
export function contrastOnWhite(colour) {
  const parts = [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16) / 255);
  const [red, green, blue] = parts.map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
  return 1.05 / (0.2126 * red + 0.7152 * green + 0.0722 * blue + 0.05);
}

/** The least contrast of titles that the server takes. */
export const LEAST_CONTRAST = 4.5;
