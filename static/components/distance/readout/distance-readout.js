/** The distance of the shown frame in very large digits, its interval, and its reliability. */

import { html, render, setText } from '../../../core/page/html.js';
import { USUAL_LIMIT_M_PER_MIN } from '../../../core/survey/health.js';
import { isUnmeasured } from '../../../core/survey/inspection.js';
import { isSeen, jointBehind } from '../../../core/wall/joints.js';
import { mayEdit } from '../../../core/page/rights.js';
import { ROUNDING_MM } from '../../../core/wall/spans.js';
import { Component } from '../../../core/page/store.js';
import { BY_CAMERA, STATUSES } from '../../../core/survey/track.js';
import { chainage, chainageNumber, lengthUnit, plusMinus, speed, u95FromSigma } from '../../../core/wall/units.js';
import { t, wordFor } from '../../../core/page/words.js';
import { icon } from '../../shared/icon/icon.js';
import { jointsText, openIntervalDetail } from './interval-detail.js';
import { LEVELS, healthWords, upperFirst } from './health-words.js';
import { Speedometer, speedAt } from './speedometer.js';

const USUAL_LIMIT = speed(USUAL_LIMIT_M_PER_MIN);
const SIGNS = { ok: 'check', weak: 'alert', lost: 'alert', none: 'wait' };
/** How long bad news stays in a live picture, so that it can be read. */
const BAD_NEWS_MS = 700;
/** Without a new picture for so long, nobody knows where the robot is. */
const SILENT_MS = 2000;
/** Changes faster than this are not announced. */
const ANNOUNCED_AFTER_MS = 1000;

export class DistanceReadout extends Component {
  #speedometer = new Speedometer();
  /** Video time of the last frame that was not lost. */
  #heldS = null;
  /** When the last picture was shown, by `performance.now`. */
  #shownMs = performance.now();
  #words = null;
  #wordsMs = 0;
  #announceTimer = 0;

  mount() {
    this.desk = this.closest('inspection-page').desk;
    this.setAttribute('role', 'region');
    this.setAttribute('aria-label', t('readout.label'));
    /** @type {Parts<'readout/distance-readout'>} */
    this.parts = render(
      this,
      html`<p class="readout__distance nowrap number"><span data-part="value">–</span> <span class="readout__unit dim">${lengthUnit}</span></p>
        <div class="readout__trust stack grow">
          <p class="readout__interval nowrap number"><button class="readout__why bare" data-part="why" title="${t('interval.title')}"><span
            data-part="interval"></span> <span class="dim">(95 %)</span>${icon('info')}</button></p>
          <p class="readout__health strong number"><span data-part="sign"></span><span data-part="health"></span></p>
          <p class="readout__more flow small dim number"><span class="unless-empty" data-part="joint"></span><span class="unless-empty" data-part="speed"></span></p>
        </div>
        <p class="readout__joints small dim" data-part="joints" hidden><span data-part="jointsText"></span>
          <button class="link" data-part="takeBack" ${!mayEdit() && 'hidden'}>${t('readout.take_back')}</button></p>
        <p class="visually-hidden" role="status" data-part="announced"></p>`,
    );
    this.listen(this.parts.takeBack, 'click', () => this.#takeBack());
    this.listen(this.parts.why, 'click', () => openIntervalDetail(this.desk));
    this.listen(this.desk.playhead, 'change', () => (this.#shownMs = performance.now()));
    this.listen([this.desk.playhead, this.desk.health, this.desk.corrections], 'change', () => this.repaint());
    const timer = setInterval(() => this.desk.playhead.value.isLive && this.repaint(), SILENT_MS / 4);
    // Where the read-out is sticky, a focused element is scrolled to a place below it.
    const resized = new ResizeObserver(() => {
      document.documentElement.style.setProperty('--readout-height', `${this.offsetHeight}px`);
    });
    resized.observe(this);
    this.signal.addEventListener('abort', () => {
      clearTimeout(this.#announceTimer);
      clearInterval(timer);
      resized.disconnect();
    });
    this.paint();
  }

  paint() {
    const { parts } = this;
    const { row, isLive } = this.desk.playhead.value;
    setText(parts.value, row ? chainageNumber(row.distance_mm / 1000) : '–');
    const isUnmeasuredRun = isUnmeasured(this.desk.inspection.value);
    setText(parts.interval, row && !isUnmeasuredRun ? plusMinus(u95FromSigma(row.sigma_distance_mm)) : '± –');
    setText(parts.joint, row ? this.#joint(row.distance_mm) : '');
    parts.why.disabled = !row || isUnmeasuredRun;
    this.#showJoints();
    this.#showSpeed(isUnmeasuredRun ? null : this.#speed(row, isLive));
    this.#showHealth(
      isUnmeasuredRun
        ? { level: 'none', what: 'unmeasured', text: t('readout.unmeasured') }
        : this.#healthWords(row, isLive),
      isLive,
    );
  }

  /** Shows the nearest joint before the frame, from which a repair crew counts; and whether it was seen. */
  #joint(distanceMm) {
    const { joints } = this.desk;
    if (joints.length === 0 || distanceMm < -ROUNDING_MM) return '';
    const joint = jointBehind(joints, distanceMm / 1000);
    if (joint === null)
      return isSeen(joints[0]) && joints[0].number !== null ? t('readout.before_joint', joints[0]) : '';
    const past = { number: joint.number, past: chainage(distanceMm / 1000 - joint.distance_m) };
    return isSeen(joint) ? t('readout.joint', past) : t('readout.joint_expected', past);
  }

  /** Shows the scale set by the joints. */
  #showJoints() {
    const { parts } = this;
    const done = this.desk.corrections.value?.result?.by_joints ?? null;
    parts.joints.hidden = done === null;
    setText(parts.jointsText, done ? jointsText(done) : '');
  }

  /** Stops the joints from setting the scale; undo restores them. */
  #takeBack() {
    const { corrections } = this.desk;
    const joints = { ...corrections.draft.value.joints, use: false };
    // Joins other pending changes; alone it is applied at once.
    if (corrections.isEdited) corrections.edit({ joints });
    else this.closest('inspection-page').correct({ ...corrections.value.stated, joints }, t('readout.taken_back'));
  }

  #speed(row, isLive) {
    if (isLive && row) {
      this.#speedometer.add(row);
      return this.#speedometer.value;
    }
    this.#speedometer.clear();
    return row && speedAt(this.desk.track, row);
  }

  #showSpeed(mPerMin) {
    const isTooFast = mPerMin > USUAL_LIMIT_M_PER_MIN;
    const now = mPerMin === null ? '' : speed(mPerMin);
    const [limit] = USUAL_LIMIT.split(' ');
    setText(this.parts.speed, isTooFast ? t('readout.speed_limit', { speed: now, limit }) : now);
    this.parts.speed.title = isTooFast ? t('readout.speed_why', { limit: USUAL_LIMIT }) : '';
    this.parts.speed.classList.toggle('readout__speed--warning', isTooFast);
  }

  #healthWords(row, isLive) {
    if (!row) return healthWords(null, null, 0, false, true);
    const silentMs = performance.now() - this.#shownMs;
    const { live } = this.desk.inspection.value;
    if (isLive && live && !live.is_ending && silentMs > SILENT_MS) {
      return { level: 'lost', what: 'silent', text: t('live.stalled', { s: Math.round(silentMs / 1000) }) };
    }
    const health = isLive ? row.health : this.desk.health.at(row.frame);
    const isUseful = u95FromSigma(row.sigma_distance_mm) <= this.desk.inspection.value.useful_within_m;
    if (row.source && !BY_CAMERA.has(row.source)) {
      return {
        level: isUseful ? 'ok' : 'weak',
        what: row.source,
        text: upperFirst(wordFor('distance_source', row.source)),
      };
    }
    return healthWords(row.status, health, row.time_s - this.#lastHeldS(row), Boolean(row.looking_around), isUseful);
  }

  /** Returns the time of the last frame, up to this row, in which the wall was tracked. */
  #lastHeldS(row) {
    const isOn = this.#heldS !== null && row.time_s >= this.#heldS && this.desk.playhead.value.isLive;
    if (row.status !== 'lost') this.#heldS = row.time_s;
    else if (!isOn) this.#heldS = this.#heldBefore(row);
    return this.#heldS;
  }

  #heldBefore({ frame, time_s: timeS }) {
    const { track } = this.desk;
    const states = track.column('status');
    let held = Math.min(frame, states.length - 1);
    while (held > 0 && STATUSES[states[held]] === 'lost') held -= 1;
    return track.row(held)?.time_s ?? timeS;
  }

  #showHealth(words, isLive) {
    const now = performance.now();
    const rank = ({ level }) => LEVELS.indexOf(level);
    const isBetter = this.#words !== null && rank(words) < rank(this.#words);
    if (isLive && isBetter && now - this.#wordsMs < BAD_NEWS_MS) return;
    this.#wordsMs = now;
    setText(this.parts.health, words.text);
    if (this.dataset.status !== words.level) {
      this.dataset.status = words.level;
      render(this.parts.sign, icon(SIGNS[words.level]));
    }
    if (this.#words?.what !== words.what) this.#announceSoon();
    this.#words = words;
  }

  #announceSoon() {
    clearTimeout(this.#announceTimer);
    this.#announceTimer = setTimeout(() => (this.parts.announced.textContent = this.#words.text), ANNOUNCED_AFTER_MS);
  }
}

customElements.define('distance-readout', DistanceReadout);
