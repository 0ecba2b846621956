/** The shared state of the inspection page: the data, the play head, the selection, tagging. */

import { AttachmentOutbox } from '../../../core/server/attachment-outbox.js';
import { Attachments } from '../../../core/defects/attachments.js';
import { Axis } from '../../../core/wall/axis.js';
import { followRun } from '../../../core/wall/axis-following.js';
import { followChanges } from '../../../core/server/changes-elsewhere.js';
import { Checks } from '../../../core/survey/checks.js';
import { Catalogue } from '../../../core/defects/codes.js';
import { lastCodes } from '../../../core/defects/code-chain.js';
import { Conflicts } from '../../../core/defects/conflicts.js';
import { Corrections } from '../../../core/survey/corrections.js';
import { Diagnosis } from '../../../core/survey/diagnosis.js';
import { FilmCounter } from '../../../core/survey/counter.js';
import { Health } from '../../../core/survey/health.js';
import { History } from '../../../core/defects/history.js';
import { Inspection, isUnmeasured } from '../../../core/survey/inspection.js';
import { jointsOf } from '../../../core/wall/joints.js';
import { LiveFeed } from '../../../core/server/live.js';
import { Observations } from '../../../core/defects/observations.js';
import { Outbox } from '../../../core/server/outbox.js';
import { pageId } from '../../../core/page/new-id.js';
import { nextOpen, questionsOf } from '../../../core/defects/questions.js';
import { Proposals } from '../../../core/defects/proposals.js';
import { RemarkDrafts } from '../../../core/defects/remark-drafts.js';
import { isLocked, Review, whyLocked } from '../../../core/defects/review.js';
import { lock, mayEdit } from '../../../core/page/rights.js';
import { ROUNDING_MM } from '../../../core/wall/spans.js';
import { Store, listenTo } from '../../../core/page/store.js';
import { Track } from '../../../core/survey/track.js';
import { u95FromSigma } from '../../../core/wall/units.js';
import { Unrolled } from '../../../core/wall/unrolled.js';
import { WallGrid } from '../../../core/wall/wall.js';
import { t } from '../../../core/page/words.js';
import { Findings } from '../../../core/defects/findings.js';
import { followIn3d } from './in-3d.js';
import { Large } from './large.js';
import { Overtaken } from './overtaken.js';
import { Measuring } from '../../film/measure/measuring.js';

/**
 * @typedef {object} Playhead
 * @property {number} frame -1 before the first picture
 * @property {import('../../../core/survey/track.js').Row|null} row null where the frame is not tracked
 * @property {boolean} isLive
 * @property {number|null} capturedMs when the camera delivered the picture, by `performance.now`; null
 *     when it is not live, or not from a camera
 */

/**
 * A code applies to the last tag made by pointing until the robot has moved this far, in m; and a tag is asked about
 * until it has, so that later keys are not taken for answers.
 */
const POINTED_M = 0.5;

/**
 * Events: `fault` (detail: a sentence or an error), `tagged` (detail: the observation), `done` (detail
 * {text, action?, run?}: the effect of a command, and an alternative).
 */
export class Desk extends EventTarget {
  playhead = new Store(/** @type {Playhead} */ ({ frame: -1, row: null, isLive: false, capturedMs: null }));
  /** Id of the selected observation. */
  selection = new Store(/** @type {string|null} */ (null));
  /** Whether the form of the selected observation is open. */
  editing = new Store(false);
  /**
   * What open questions are asked: those of the tag that was just made, of one defect after the other, or null: none
   * by themselves.
   */
  asking = new Store(/** @type {'tag'|'all'|null} */ (null));
  /** Name of the visible tab beside the film: 'defects', 'header' and the others of tabs.js. */
  tab = new Store('defects');
  conflicts = new Conflicts();
  /** The part of the culvert that the strips show. */
  axis = new Axis();
  /** Takes clicks on the picture instead of a tag. */
  picking = new Store(/** @type {((mark: {frame: number, pixel: [number, number]}) => void)|null} */ (null));
  /** @type {((frame: number) => void)|null} set by the page: shows a frame */
  seek = null;
  /** @type {import('../../../core/page/desk-windows.js').DeskWindows|null} parts in windows of their own; null in such a window */
  windows = null;
  /** @type {import('../../../core/survey/people.js').People} who else is here; only of a whole desk */
  people;

  #signal;
  /** Revision of the distances on the page. */
  #revision;
  /** Generation of the track that the row of the shown frame belongs to. */
  #generation = 0;
  /** Number of joints known to the server at its last picture. */
  #joints = null;
  /** Notices about picture and rig at that time. */
  #notices = null;
  /** The last tag made by pointing, and the pose of the robot then. */
  #pointed = { id: null, row: null };
  /** Frame of a tag whose code is being typed, and the tag that was pointed at then. */
  #held = { frame: -1, pointed: { id: null } };
  /** The pose of the last tag: for a live picture it is known before the track contains it. */
  #tagged = { frame: -1, row: null };
  /** The pose of the robot when the tag that is asked about was made, or when it was answered last. */
  #asked = null;
  /** Defects that were asked about since the person began to complete them. */
  #visited = new Set();
  #overtaken;

  /** Fetches everything needed to draw the page. */
  static async open(id, signal) {
    const inspection = new Inspection(id, signal);
    const [outbox, catalogue, wall] = await Promise.all([
      Outbox.open(),
      inspection
        .load()
        .then(() => Catalogue.load(signal, /** @type {string|null} */ (inspection.value.header.code_pack))),
      WallGrid.load(id, signal).catch((error) => {
        if (error.code !== 'damaged_track') throw error;
        return null; // the page says so, and offers to track again
      }),
    ]);
    const attachmentOutbox = await AttachmentOutbox.open(outbox, signal);
    return new Desk({ inspection, outbox, attachmentOutbox, catalogue, wall }, signal);
  }

  constructor({ inspection, outbox, attachmentOutbox, catalogue, wall }, signal) {
    super();
    this.#signal = signal;
    /** The part that fills the window. */
    this.large = new Large(signal);
    this.#revision = inspection.value.revision;
    this.inspection = inspection;
    this.outbox = outbox;
    this.attachmentOutbox = attachmentOutbox;
    this.catalogue = catalogue;
    // Keys, questions and checks are all those of the pack.
    const onPack = () => (inspection.value.header.code_pack ?? null) !== catalogue.pack && location.reload();
    inspection.addEventListener('change', onPack, { signal });
    /** null if the camera sees no wall, or nobody knows what it saw */
    this.wall = isUnmeasured(inspection.value) ? null : wall;
    this.track = new Track(inspection.id);
    this.health = new Health(inspection.id);
    this.unrolled = new Unrolled(inspection.id, signal);
    this.history = new History();
    this.measuring = new Measuring(this, signal);
    this.observations = new Observations(
      inspection.id,
      outbox,
      this.history,
      (frame, pixel) => this.#placeOf(frame, pixel),
      signal,
    );
    this.findings = new Findings(inspection.id, outbox, this.history, this.observations, signal);
    this.attachments = new Attachments(inspection.id, attachmentOutbox, this.history, signal);
    this.attachments.loadPatiently();
    this.corrections = new Corrections(inspection.id, signal);
    this.counter = new FilmCounter(inspection.id, signal);
    this.diagnosis = new Diagnosis(inspection);
    this.checks = new Checks(inspection.id, signal);
    this.proposals = new Proposals(inspection.id, signal);
    this.review = new Review(inspection.id, signal);
    /** Remarks that are being typed. */
    this.drafts = new RemarkDrafts(inspection.id);
    lock(isLocked(inspection.value));
    if (mayEdit()) this.corrections.restore();
    this.#overtaken = new Overtaken(this, signal);
    this.live = new LiveFeed(`/api/inspections/${inspection.id}/live?page=${pageId}`, signal);
    followChanges(
      this.live,
      () => this.readAgain(),
      (error) => this.fault(error),
      signal,
    );
    followRun(this, signal);
    followIn3d(this, signal);
    this.editing.addEventListener('change', () => this.editing.value || this.asking.set(null), { signal });
    this.track.addEventListener('change', () => this.#findRow(), { signal });
    this.observations.addEventListener('change', () => this.#dropLostSelection(), { signal });
    inspection.addEventListener('edited', ({ detail }) => this.history.add(detail), { signal });
    this.live.addEventListener('message', ({ detail }) => this.#compareRevision(detail.header), { signal });
    this.live.addEventListener('findings', () => this.findings.loadPatiently(), { signal });
    listenTo([this.observations, this.inspection, this.corrections], 'change', signal, () => this.checks.loadSoon());
  }

  /** Reads again everything that contains distances, as they have been corrected. */
  async reload() {
    await Promise.all([this.track.reload(this.#signal), this.readPlaces()]);
  }

  /** Reads again everything that follows from the track. */
  async readPlaces() {
    const parts = [this.observations, this.attachments, this.corrections, this.findings];
    await Promise.all([...parts.map((part) => part.load()), this.#loadWall()]);
  }

  /** Reads again what people state, and the distances if somebody has corrected them. */
  async readAgain() {
    await this.inspection.load();
    await Promise.all([this.observations.load(), this.attachments.load(), this.review.load()]);
    const { revision } = this.inspection.value;
    if (revision <= this.#revision) return;
    this.#revision = revision;
    await this.reload();
  }

  /** Reads the wall again: a run shows better and better where its camera stands in the pipe. */
  async #loadWall() {
    if (this.wall) this.wall = await WallGrid.load(this.inspection.id, this.#signal);
  }

  /** Looks up the row of the shown frame again: it is another one after a correction or in another run. */
  #findRow() {
    const { frame, row, isLive } = this.playhead.value;
    if (isLive || (row && this.#generation === this.track.generation)) return;
    this.#generation = this.track.generation;
    this.playhead.set({ frame, row: this.track.row(frame), isLive, capturedMs: null });
  }

  /**
   * Replaces the statements about the distances, and reads the distances again.
   * @param {import('../../../core/survey/corrections.js').Stated} stated
   * @param {string|null} remark why, for the history
   * @param {string} [replaced] version of the statements that the change is based on
   * @returns {Promise<boolean>} false when somebody else was faster: then the change waits as a draft
   */
  async correct(stated, remark, replaced = this.corrections.value.version) {
    const before = this.corrections.value.stated;
    try {
      await this.#state(stated, remark, replaced);
    } catch (error) {
      if (!error.isOvertaken) throw error;
      this.corrections.edit(stated);
      await this.corrections.load();
      this.corrections.wait(remark);
      this.#overtaken.stateDraft();
      return false;
    }
    this.#noteCorrection(before, remark);
    return true;
  }

  /**
   * Has the server state what it offers, and reads the distances again; it can be undone.
   * @param {() => Promise<unknown>} send
   * @param {string|null} remark why, for the history
   */
  async correctBy(send, remark) {
    if (!this.corrections.value) await this.corrections.load();
    const before = this.corrections.value.stated;
    await send();
    await this.readAgain();
    this.#noteCorrection(before, remark);
  }

  #noteCorrection(before, remark) {
    const after = this.corrections.value.stated;
    this.history.add({
      what: 'correction',
      run: (isBack) => (isBack ? this.#state(before, t('corrections.taken_back')) : this.#state(after, remark)),
      isOvertaken: async (isBack) => {
        await this.corrections.load();
        return JSON.stringify(this.corrections.value.stated) !== JSON.stringify(isBack ? after : before);
      },
    });
  }

  async #state(stated, remark, replaced = this.corrections.value.version) {
    await this.corrections.apply(stated, remark, replaced);
    await this.inspection.load();
    this.#revision = this.inspection.value.revision;
    await this.reload();
  }

  /**
   * Tags a wall point of a frame, by default the shown one; without a pixel, its camera position.
   * @returns {object|null} the observation, null when there is no such frame yet
   */
  tag({ pixel = null, frame = this.playhead.value.frame, isSelected = true, ...fields }) {
    const row = this.#poseOf(frame);
    if (!mayEdit() || !row) {
      this.fault(mayEdit() ? t('desk.not_tracked') : whyLocked());
      return null;
    }
    this.#tagged = { frame, row };
    const created = this.observations.create({ ...this.#anchor(frame, pixel), ...fields });
    if (isSelected) this.select(created.id);
    this.dispatchEvent(new CustomEvent('tagged', { detail: created }));
    return created;
  }

  /** Notes the shown frame for a tag whose code is still being typed; false when nothing may be tagged. */
  hold() {
    const { frame, row } = this.playhead.value;
    const isAllowed = mayEdit() && row !== null;
    if (isAllowed) this.#held = { frame, pointed: this.#pointed };
    else this.fault(mayEdit() ? t('desk.not_tracked') : whyLocked());
    if (isAllowed) this.#tagged = { frame, row };
    return isAllowed;
  }

  /** Tags the frame that was noted, or the tag without a code that was pointed at then. */
  tagHeld(fields) {
    const { frame, pointed } = this.#held;
    const item = this.observations.find(pointed.id);
    if (item && !item.code && item.frame === frame) this.#give(item, fields);
    else this.tag({ ...fields, frame, pixel: this.aim });
  }

  /** Repeats the code, the severity and the quantities of the newest tag at the shown frame. */
  repeatLast() {
    const [last] = lastCodes(this.observations.value, 1);
    if (last) this.tagAs(last);
    else this.fault(t('desk.nothing_to_repeat'));
  }

  /** Tags the middle of the picture, with or without a code. */
  tagCentre(options = {}) {
    const created = this.tag({ ...options, pixel: this.aim });
    this.#pointed = { id: null, row: null }; // the hand is on the keys: the next code makes a new tag
    return created;
  }

  /**
   * Gives a code to the tag that was just made by pointing and has none; else tags the middle of the
   * picture with it.
   */
  tagAs(fields) {
    const item = this.#pointed.id === this.selection.value ? this.observations.find(this.#pointed.id) : null;
    if (!item || item.code || !this.#isWithin(POINTED_M, this.#pointed.row) || !mayEdit()) {
      this.tagCentre(fields);
      return;
    }
    this.#give(item, fields);
  }

  #give({ id }, fields) {
    this.observations.edit(id, fields);
    this.dispatchEvent(new CustomEvent('tagged', { detail: this.observations.find(id) }));
  }

  /** Selects what the person has pointed at. */
  select(id) {
    this.selection.set(id);
    this.#pointed = { id, row: this.playhead.value.row };
  }

  /** Asks what the code of the selected tag needs, beside the film, which goes on. */
  ask(item) {
    if (item.id !== this.selection.value || !nextOpen(questionsOf(item, this.catalogue))) return;
    this.#asked = this.playhead.value.row;
    this.asking.set('tag');
    this.editing.set(true);
  }

  /** Notes where an answer was given. */
  noteAnswer() {
    this.#asked = this.playhead.value.row;
  }

  /** Whether the robot has left the place where a tag was asked about. */
  get hasMovedOn() {
    const isKnown = Boolean(this.#asked && this.playhead.value.row);
    return this.asking.value === 'tag' && isKnown && !this.#isWithin(POINTED_M, this.#asked);
  }

  /** The defects that lack something. */
  get incomplete() {
    return this.observations.value.filter((item) => this.catalogue.missing(item).length > 0);
  }

  /** Asks what is missing of an incomplete defect, by default the first one, and then of all others. */
  askAll(id = this.incomplete[0]?.id) {
    this.#visited.clear();
    if (id) this.#askOne(id);
  }

  /** Nothing of the selected defect is asked any more: the next incomplete one is, or the keys are the film's again. */
  askNext() {
    const { value: items } = this.observations;
    const here = items.findIndex(({ id }) => id === this.selection.value);
    const left = this.asking.value === 'all' ? this.incomplete.filter(({ id }) => !this.#visited.has(id)) : [];
    const next = left.find((item) => items.indexOf(item) > here) ?? left[0];
    if (next) this.#askOne(next.id);
    else this.editing.set(false);
  }

  #askOne(id) {
    this.#visited.add(id);
    this.goTo(id);
    this.asking.set('all');
    this.editing.set(true);
  }

  /** Whether the robot moved at most `reachM` between a frame and the shown one. */
  isNear(frame, reachM) {
    return frame === this.playhead.value.frame || this.#isWithin(reachM, this.#poseOf(frame));
  }

  #isWithin(reachM, row) {
    const here = this.playhead.value.row;
    return Boolean(row && here) && Math.abs(row.distance_mm - here.distance_mm) <= 1000 * reachM + ROUNDING_MM;
  }

  /** Moves the selected tag to the middle of the shown picture; its photo follows. */
  moveHere() {
    const { frame, row } = this.playhead.value;
    if (!this.selection.value) return;
    if (row) this.observations.edit(this.selection.value, this.#anchor(frame, this.aim));
    else this.fault(t('desk.not_tracked'));
  }

  /** Whether changes of this inspection were refused and wait for a decision. */
  get hasRefused() {
    const { id } = this.inspection;
    return [this.outbox, this.attachmentOutbox].some((box) => box.openFor(id).some(({ refusal }) => refusal));
  }

  /** Resolves when nothing that was entered in this browser waits for the server, or when `signal` aborts. */
  async whenSent(signal) {
    for (const box of [this.outbox, this.attachmentOutbox]) await box.whenSent(this.inspection.id, signal);
  }

  /**
   * Shows a finding in its panel and in the film; a live picture stays, unless that is what the person asks for.
   * @param {import('../../../core/defects/findings.js').Finding} finding
   */
  lookAt({ id, frame }, isAsked = false) {
    this.findings.current.set(id);
    this.tab.set('findings');
    const isThere = frame !== null && frame < this.track.length;
    if (isThere && this.seek && (isAsked || !this.playhead.value.isLive)) this.seek(frame);
  }

  /** Selects an observation and shows its frame. */
  goTo(id) {
    const item = this.observations.find(id);
    if (!item) return; // deleted meanwhile
    this.select(id);
    if (item.frame >= this.track.length) return;
    this.seek(item.frame);
    this.#pointed = { id, row: this.track.row(item.frame) };
  }

  /**
   * The pixel that a key tags: the middle of the picture. Null if nobody knows what the camera saw, and where it
   * looks along the pipe: its middle is the far end, and such a tag has the distance of the camera.
   */
  get aim() {
    const { rig, video } = this.inspection.value;
    if (isUnmeasured(this.inspection.value) || rig.mount.view === 'forward') return null;
    const { width, height } = video;
    return [(width - 1) / 2, (height - 1) / 2];
  }

  /** Returns the pose of a frame, null where it is not tracked. */
  #poseOf(frame) {
    const shown = this.playhead.value;
    if (frame === shown.frame && shown.row) return shown.row;
    return this.track.row(frame) ?? (frame === this.#tagged.frame ? this.#tagged.row : null);
  }

  /** Returns the anchor of a tag; without a wall under the pixel the camera position counts. */
  #anchor(frame, pixel) {
    const point = pixel && this.wall?.at(...pixel, this.#poseOf(frame));
    return { frame, pixel: point ? pixel : null };
  }

  /** Returns the place of a tag, as far as the page knows it. */
  #placeOf(frame, pixel) {
    const row = this.#poseOf(frame);
    if (!row) return { distance_m: null, distance_u95_m: null, distance_source: null, clock: null, time_s: null };
    const point = pixel && this.wall?.at(...pixel, row);
    return {
      distance_m: point ? point.distance_m : row.distance_mm / 1000,
      distance_u95_m: u95FromSigma(row.sigma_distance_mm),
      distance_source: row.source ?? null,
      clock: point && point.clock_h !== null ? Math.round(point.clock_h) % 12 || 12 : null,
      time_s: row.time_s,
    };
  }

  /** The distance of the middle of the shown picture in m, null where it is not tracked. */
  get hereM() {
    return this.#placeOf(this.playhead.value.frame, this.aim).distance_m;
  }

  /** The joints of the pipe, seen and expected. */
  get joints() {
    return jointsOf(this.corrections.value?.result ?? null);
  }

  /** Returns the hour of the wall under the pixel of an observation, null where none is seen. */
  measuredHour({ frame, pixel }) {
    return this.#placeOf(frame, pixel).clock;
  }

  /** Selects the next observation along the pipe, or the previous one. */
  goToNeighbour(direction) {
    const items = this.observations.value;
    if (items.length === 0) return;
    const here = items.findIndex(({ id }) => id === this.selection.value);
    const at = here < 0 ? (direction > 0 ? 0 : items.length - 1) : here + direction;
    this.goTo(items[Math.min(Math.max(at, 0), items.length - 1)].id);
  }

  /** Reads again what has changed: distances corrected by others or by joints, seen joints, notices. */
  async #compareRevision({ revision, joints, notices }) {
    const isOther = revision !== undefined && revision > this.#revision;
    const hasMoreJoints = this.#joints !== null && joints !== this.#joints;
    const known = String(notices);
    const hasOtherNotices = this.#notices !== null && known !== this.#notices;
    this.#joints = joints;
    this.#notices = known;
    if (!isOther && !hasMoreJoints && !hasOtherNotices) return;
    this.#revision = Math.max(this.#revision, revision ?? 0);
    try {
      if (isOther) {
        await this.inspection.load(); // first, as a track that is read after the end is complete
        await this.reload();
      } else await Promise.all([this.corrections.load(), this.#loadWall()]);
    } catch (error) {
      if (error.name !== 'AbortError') this.fault(error);
    }
  }

  #dropLostSelection() {
    const { value: id } = this.selection;
    if (id !== null && !this.observations.find(id)) this.selection.set(null);
  }

  /** Shows what was done, with an undo or an alternative. */
  done(text, other = {}) {
    this.dispatchEvent(new CustomEvent('done', { detail: { text, ...other } }));
  }

  /** Announces why a command failed. @param {string|Error} why */
  fault(why) {
    this.dispatchEvent(new CustomEvent('fault', { detail: why }));
  }
}
