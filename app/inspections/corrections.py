"""Corrected distances: what was stated is kept, the track that follows from it is worked out.

The raw track never changes.  A corrected one is kept in memory as long as neither what was stated
nor the run has changed; while a run goes on, its newest frames are carried on from the last
solution, and least squares are solved again every few seconds at most.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from cachetools import LRUCache

from app.errors import ChangedMeanwhile, DiskFull, described
from app.storage.inspections import InspectionStore, Rescaling
from app.storage.tables import ENDED, Inspection
from app.survey.adjustment import Adjusted, Refusal, adjust
from app.survey.corrected import Corrected
from app.survey.makeup import Makeup, makeup_of
from app.survey.notices import Notice, notices_of
from app.survey.stated import Joints, Stated
from app.survey.track_rows import estimate_at
from app.survey.versions import require_version
from app.tracking.live import Live
from app.tracking.tracks import Tracks
from vo_core import Rig, Track
from vo_core.errors import InvalidCorrection
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_SOLVED_FRAMES_KEPT = 1_000_000
"""Frames of the solutions that are kept: some 100 bytes each beside the raw track."""
_LEAST_FRAMES = 10_000
"""A shorter one counts as so many: of joints and what else there is beside frames."""
_STATED_KEPT = 512
_MOST_TRIES = 5
"""Of a change that others are faster with."""
_SOLVE_EVERY_S = 5.0
_SOLVE_SHARE = 0.1
"""While a run goes on it is solved so often at most, and for so much of the time: some 10 ms for a
minute of video with joints, seconds for two hours with hundreds of them."""


@dataclass(frozen=True)
class _Statement:
    revision: int
    stated: Stated
    rig: Rig


@dataclass(frozen=True)
class _Solution:
    revision: int
    run: tuple[int, bool]
    """Which run of tracking, and whether it went on."""
    solved_s: float
    took_s: float
    corrected: Corrected
    adjusted: Adjusted

    @property
    def is_due(self) -> bool:
        """Whether the run goes on and may be solved again."""
        if not self.is_growing or not self.adjusted.can_change:
            return False
        return time.monotonic() >= self.solved_s + max(_SOLVE_EVERY_S, self.took_s / _SOLVE_SHARE)

    @property
    def is_growing(self) -> bool:
        """Whether the run went on when it was solved."""
        return self.run[1]


class Corrections:
    """State, preview, and use in place of the raw track."""

    def __init__(self, inspections: InspectionStore, tracks: Tracks, live: Live) -> None:
        self._inspections = inspections
        self._tracks = tracks
        self._live = live
        self._lock = threading.Lock()
        """Guards what is below."""
        self._solving: dict[str, threading.Lock] = {}
        """Held by whoever solves an inspection: a page asks five times at once for what takes
        seconds of a long run."""
        self._statements: LRUCache[str, _Statement] = LRUCache(_STATED_KEPT)
        self._solutions: LRUCache[str, _Solution] = LRUCache(_SOLVED_FRAMES_KEPT, _frames_of)

    def get(self, inspection_id: str) -> Corrected:
        """What holds now.

        Raises:
            InspectionNotFound: There is none of this id.
        """
        corrected = self._solution(inspection_id).corrected
        return replace(corrected, tilt=self._tracks.tilt(inspection_id))

    def preview(self, inspection_id: str, stated: Stated) -> Corrected:
        """What would hold; a known length that would be refused is shown with its closure.

        Raises:
            InspectionNotFound: There is none of this id.
        """
        rig = self._statement(inspection_id).rig
        try:
            adjusted = adjust(
                self._tracks.get(inspection_id), rig, stated, self._tracks.sightings(inspection_id)
            )
        except InvalidCorrection as error:
            return Corrected(stated, None, described(error), Refusal.of(error))
        tilt = self._tracks.tilt(inspection_id)
        return Corrected(stated, adjusted, _refusal(adjusted), tilt=tilt)

    def put(
        self,
        inspection_id: str,
        stated: Stated,
        remark: str | None,
        who: str,
        *,
        replaced: str | None = None,
    ) -> Corrected:
        """State it in place of what was stated before; it is committed and synced on return.

        Args:
            inspection_id: Which.
            stated: All that is stated from now on.
            remark: Why.
            who: For the record.
            replaced: Version of what it was made of; None replaces whatever there is.
        Raises:
            InspectionNotFound: There is none of this id.
            InvalidCorrection: It cannot be applied to the track as it is; nothing was stored.
            ChangedMeanwhile: Something else than `replaced` is stated; nothing was stored.
        """

        def require(stored: Mapping[str, Any]) -> None:
            require_version(Stated.from_json(stored).to_json(), stated.to_json(), replaced)

        statement, run = self._statement(inspection_id), self._tracks.run(inspection_id)
        began_s = time.monotonic()
        adjusted = adjust(
            self._tracks.get(inspection_id),
            statement.rig,
            stated,
            self._tracks.sightings(inspection_id),
        )
        if adjusted.refused is not None:
            raise InvalidCorrection(adjusted.refused.refusal())
        revision = self._inspections.correct(
            inspection_id,
            who,
            stated.to_json(),
            remark,
            unstated=Stated().to_json(),
            require=require,
        )
        corrected = Corrected(stated, adjusted, None)
        self._keep(inspection_id, _Statement(revision, stated, statement.rig))
        now_s = time.monotonic()
        self._keep_solution(
            inspection_id,
            _Solution(revision, run, now_s, now_s - began_s, corrected, adjusted),
        )
        if revision != statement.revision:
            logger.info("Inspection %s corrected by %s.", inspection_id, who)
            self._live.corrected(inspection_id)
        return replace(corrected, tilt=self._tracks.tilt(inspection_id))

    def change(
        self, inspection_id: str, change: Callable[[Stated], Stated], remark: str | None, who: str
    ) -> Corrected:
        """State what `change` makes of what is stated, also while others state something else.

        Raises:
            InspectionNotFound: There is none of this id.
            InvalidCorrection: It cannot be applied to the track as it is; nothing was stored.
            ChangedMeanwhile: Others were faster again and again; nothing was stored.
        """
        for tries_left in reversed(range(_MOST_TRIES)):
            before = self.get(inspection_id)
            try:
                return self.put(
                    inspection_id, change(before.stated), remark, who, replaced=before.version
                )
            except ChangedMeanwhile:
                if not tries_left:
                    raise
        raise AssertionError  # the last try returns or raises

    def rescaled(self, inspection_id: str, change: Rescaling) -> bool:
        """Record that the newest solution has another scale than was published; all is read again.

        False if something else was stated meanwhile: then nothing is recorded.

        Raises:
            InspectionNotFound: There is none of this id.
            DiskFull: It could not be recorded.
        """
        statement, solution = self._statement(inspection_id), self._last_solution(inspection_id)
        revision = self._inspections.rescale(inspection_id, change, statement.revision)
        if revision is None:
            return False
        self._keep(inspection_id, replace(statement, revision=revision))
        self._keep_solution(inspection_id, replace(solution, revision=revision))
        self._live.corrected(inspection_id)
        return True

    def newest(self, inspection_id: str) -> Adjusted:
        """The last solution of any age; cheap."""
        return self._last_solution(inspection_id).adjusted

    def adjusted(self, inspection_id: str) -> Adjusted:
        """The newest solution; the last frames of a run that goes on may not be in it."""
        return self._solution(inspection_id).adjusted

    def notices(self, inspection_id: str) -> list[Notice]:
        """Where picture and rig disagree, by the last solution of any age; cheap."""
        return notices_of(self.newest(inspection_id), self._tracks.tilt(inspection_id))

    def makeup(self, inspection_id: str, frame: int | None) -> Makeup | None:
        """What the interval of a frame is made of, of the furthest one without; see `makeup_of`.

        Raises:
            InspectionNotFound: There is none of this id.
        """
        adjusted, raw = self.adjusted(inspection_id), self._tracks.get(inspection_id)
        if not len(raw):
            return None
        far = int(adjusted.extended(raw).distance_mm.argmax())
        return makeup_of(adjusted, raw, far if frame is None else frame)

    def forget(self, inspection_id: str) -> None:
        """Drop what is held in memory."""
        with self._lock:
            self._statements.pop(inspection_id, None)
            self._solutions.pop(inspection_id, None)
            self._solving.pop(inspection_id, None)

    def track(self, inspection_id: str) -> Track:
        """The corrected track as far as it is, perhaps empty."""
        adjusted = self.adjusted(inspection_id)
        _, is_growing = self._tracks.run(inspection_id)
        return adjusted.extended(self._tracks.get(inspection_id)) if is_growing else adjusted.track

    def at(self, inspection_id: str, frame: int | None) -> Estimate | None:
        """The corrected estimate of a frame, None for the newest; None if it is not tracked."""
        raw = self._tracks.get(inspection_id)
        estimate = estimate_at(raw, len(raw) - 1 if frame is None else frame)
        return None if estimate is None else self.estimate(inspection_id, estimate)

    def estimate(self, inspection_id: str, raw: Estimate) -> Estimate:
        """The corrected estimate of a frame that was just tracked; cheap."""
        return self._last_solution(inspection_id).adjusted.estimate(raw)

    def chainage_mm(self, inspection_id: str, raw_mm: float) -> float:
        """The corrected distance of a raw one; cheap."""
        return self._last_solution(inspection_id).adjusted.chainage_mm(raw_mm)

    def revision(self, inspection_id: str) -> int:
        """Rises with every correction.

        Raises:
            InspectionNotFound: There is none of this id.
        """
        return self._statement(inspection_id).revision

    def is_stated(self, inspection: Inspection) -> bool:
        """Whether anything is stated that moves distances."""
        stated = Stated.from_json(inspection.corrections)
        return stated not in (Stated(), Stated(joints=Joints(use=False)))

    def end(self, inspection: Inspection) -> tuple[float, float | None] | None:
        """Distance and its sigma, mm, in the last frame of an ended inspection; None without.

        Nobody knows the sigma of a survey that another program has measured.
        """
        if inspection.distance_mm is None:
            return None
        if inspection.sigma_distance_mm is None and not self.is_stated(inspection):
            return inspection.distance_mm, None
        if inspection.corrected_mm is not None and inspection.sigma_corrected_mm is not None:
            return inspection.corrected_mm, inspection.sigma_corrected_mm
        track = self.track(inspection.id)
        if not len(track):
            return None
        distance_mm = float(track.distance_mm[-1])
        if inspection.sigma_distance_mm is None:
            return distance_mm, None
        sigma_mm = float(track.sigma_distance_mm[-1])
        if inspection.status in ENDED:
            self._keep_end(inspection, distance_mm, sigma_mm)
        return distance_mm, sigma_mm

    def _keep_end(self, inspection: Inspection, distance_mm: float, sigma_mm: float) -> None:
        try:
            self._inspections.record_corrected_end(
                inspection.id, inspection.revision, distance_mm, sigma_mm
            )
        except DiskFull as full:  # it is worked out again the next time
            logger.warning("The corrected end of %s could not be kept: %s", inspection.id, full)

    def _last_solution(self, inspection_id: str) -> _Solution:
        """Return the solution of this revision and run, of any age."""
        known = self._known(inspection_id)
        if known is not None:
            return known
        with self._being_solved(inspection_id):
            return self._known(inspection_id) or self._solve(inspection_id)

    def _solution(self, inspection_id: str) -> _Solution:
        """Return a solution that is not older than some seconds while the run goes on."""
        known = self._last_solution(inspection_id)
        if not known.is_due:
            return known
        with self._being_solved(inspection_id):
            known = self._known(inspection_id) or self._solve(inspection_id)
            return self._solve(inspection_id) if known.is_due else known

    def _being_solved(self, inspection_id: str) -> threading.Lock:
        with self._lock:
            return self._solving.setdefault(inspection_id, threading.Lock())

    def _known(self, inspection_id: str) -> _Solution | None:
        """Return the kept solution, None if it is not of this revision and run."""
        statement, run = self._statement(inspection_id), self._tracks.run(inspection_id)
        with self._lock:
            known = self._solutions.get(inspection_id)
        is_current = known is not None and (known.revision, known.run) == (statement.revision, run)
        return known if is_current else None

    def _solve(self, inspection_id: str) -> _Solution:
        """What was stated could be applied once; what cannot be now is left out and reported."""
        statement, run = self._statement(inspection_id), self._tracks.run(inspection_id)
        raw = self._tracks.get(inspection_id)
        stated = statement.stated.within(len(raw)) if run[1] else statement.stated
        sightings, began_s = self._tracks.sightings(inspection_id), time.monotonic()
        refusal = None
        try:
            adjusted = adjust(raw, statement.rig, stated, sightings)
            error = _refusal(adjusted)
        except InvalidCorrection as failure:
            unadjusted = stated.within(len(raw)).unadjusted()
            adjusted = adjust(raw, statement.rig, unadjusted, sightings)
            error, refusal = described(failure), Refusal.of(failure)
        corrected = Corrected(statement.stated, adjusted, error, refusal)
        now_s = time.monotonic()
        solution = _Solution(statement.revision, run, now_s, now_s - began_s, corrected, adjusted)
        self._keep_solution(inspection_id, solution)
        return solution

    def _statement(self, inspection_id: str) -> _Statement:
        with self._lock:
            known = self._statements.get(inspection_id)
        if known is not None:
            return known
        row = self._inspections.get(inspection_id)
        stated = Stated.from_json(row.corrections)
        statement = _Statement(row.revision, stated, Rig.model_validate(row.rig))
        return self._keep(inspection_id, statement)

    def _keep(self, inspection_id: str, statement: _Statement) -> _Statement:
        """The newest of two threads' statements holds."""
        with self._lock:
            known = self._statements.get(inspection_id)
            if known is None or known.revision <= statement.revision:
                known = self._statements[inspection_id] = statement
            return known

    def _keep_solution(self, inspection_id: str, solution: _Solution) -> None:
        with self._lock:
            known = self._solutions.get(inspection_id)
            if known is None or known.revision <= solution.revision:
                self._solutions[inspection_id] = solution


def _refusal(adjusted: Adjusted) -> dict[str, str] | None:
    if adjusted.refused is None:
        return None
    return described(InvalidCorrection(adjusted.refused.refusal()))


def _frames_of(solution: _Solution) -> int:
    return min(max(len(solution.adjusted.raw), _LEAST_FRAMES), _SOLVED_FRAMES_KEPT)
