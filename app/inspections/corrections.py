"""Corrected distances: statements are stored, the corrected track is derived from them.

The raw track never changes. The corrected one stays in memory until a statement or the run changes.
During a run, the newest frames are extrapolated from the last solution, and least squares are
solved again every few seconds at most.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from cachetools import LRUCache

from app.errors import Busy, ChangedMeanwhile, DamagedTrack, DiskFull, described
from app.inspections.counters import Counters
from app.storage.database.tables import ENDED, Inspection
from app.storage.records.corrections import CorrectionStore, Rescaling
from app.storage.records.inspections import InspectionStore
from app.survey.adjustment.adjust import adjust
from app.survey.adjustment.adjusted_track import Adjusted, Refusal
from app.survey.distances.corrected import Corrected
from app.survey.distances.notices import Notice, notices_of
from app.survey.distances.stated import Joints, Stated
from app.survey.distances.track_rows import estimate_at
from app.survey.distances.uncertainty_budget import UncertaintyBudget, budget_of
from app.survey.versions import require_version
from app.tracking.live import Live
from app.tracking.tracks import Tracks
from vo_core import Rig, Track
from vo_core.errors import InvalidCorrection
from vo_core.geometry.initial_pose import InitialPose
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

_SOLVED_FRAMES_KEPT = 1_000_000
"""Frames of solutions held in memory: some 100 bytes each beside the raw track."""
_LEAST_FRAMES = 10_000
"""A shorter track counts as this many frames, because its joints and other parts need memory
too."""
_STATED_KEPT = 512
_MOST_TRIES = 5
"""Tries of a change while other changes come first."""
_SOLVE_EVERY_S = 5.0
_SOLVE_SHARE = 0.1
"""Shortest time between solutions during a run, and largest share of time spent on them: some 10 ms
for a minute of video with joints, seconds for two hours with hundreds of them."""


@dataclass(frozen=True)
class _Statement:
    revision: int
    stated: Stated
    rig: Rig


@dataclass(frozen=True)
class _Solution:
    revision: int
    run: tuple[int, bool]
    """The number of the tracking run, and whether it was running."""
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
        """Whether the run was going on when it was solved."""
        return self.run[1]


class Corrections:
    """Stores statements, previews them, and provides the corrected track."""

    def __init__(
        self,
        inspections: InspectionStore,
        store: CorrectionStore,
        tracks: Tracks,
        counters: Counters,
        live: Live,
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._tracks = tracks
        self._counters = counters
        self._live = live
        self._lock = threading.Lock()
        """Guards the next fields."""
        self._solving: dict[str, threading.Lock] = {}
        """Held while an inspection is solved: a page sends five concurrent requests for a result
        that takes seconds for a long run."""
        self._statements: LRUCache[str, _Statement] = LRUCache(_STATED_KEPT)
        self._forgotten = 0
        """Number of calls of `forget`: what was read before one of them is not kept after it."""
        self._solutions: LRUCache[str, _Solution] = LRUCache(_SOLVED_FRAMES_KEPT, _frames_of)

    def get(self, inspection_id: str) -> Corrected:
        """Return the current statements and their result.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        corrected = self._solution(inspection_id).corrected
        return replace(corrected, tilt=self._tracks.tilt(inspection_id))

    def preview(self, inspection_id: str, stated: Stated) -> Corrected:
        """Return the result of other statements; a refused known length is shown with its closure.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        rig = self._statement(inspection_id).rig
        try:
            adjusted = self._adjusted(inspection_id, rig, stated)
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
        """Replace all statements; they are committed and synced on return.

        Args:
            inspection_id: The inspection.
            stated: All statements from now on.
            remark: The reason.
            who: Name for the history.
            replaced: Version that the change was based on; None replaces any version.
        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            InvalidCorrection: It cannot be applied to the present track; nothing was stored.
            ChangedMeanwhile: The version is no longer `replaced`; nothing was stored.
        """

        def require(stored: Mapping[str, Any]) -> None:
            require_version(Stated.from_json(stored).to_json(), stated.to_json(), replaced)

        forgotten = self._forgotten
        statement, run = self._statement(inspection_id), self._tracks.run(inspection_id)
        began_s = time.monotonic()
        adjusted = self._adjusted(inspection_id, statement.rig, stated)
        if adjusted.refused is not None:
            raise InvalidCorrection(adjusted.refused.refusal())
        revision = self._store.correct(
            inspection_id,
            who,
            stated.to_json(),
            remark,
            unstated=Stated().to_json(),
            require=require,
        )
        corrected = Corrected(stated, adjusted, None)
        now_s = time.monotonic()
        solution = _Solution(revision, run, now_s, now_s - began_s, corrected, adjusted)
        self._keep(inspection_id, _Statement(revision, stated, statement.rig), forgotten, solution)
        if revision != statement.revision:
            logger.info("Inspection %s corrected by %s.", inspection_id, who)
            self._live.corrected(inspection_id)
        return replace(corrected, tilt=self._tracks.tilt(inspection_id))

    def change(
        self, inspection_id: str, change: Callable[[Stated], Stated], remark: str | None, who: str
    ) -> Corrected:
        """Apply `change` to the current statements, also while others change them.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            InvalidCorrection: It cannot be applied to the present track; nothing was stored.
            ChangedMeanwhile: Other changes came first at every try; nothing was stored.
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
        """Record that the newest solution changed the published scale, and notify the listeners.

        Return False and record nothing if the statements changed meanwhile.

        Raises:
            InspectionNotFound: No inspection has this id.
            DiskFull: The change could not be recorded.
        """
        forgotten = self._forgotten
        statement, solution = self._statement(inspection_id), self._last_solution(inspection_id)
        revision = self._store.rescale(inspection_id, change, statement.revision)
        if revision is None:
            return False
        statement, solution = (
            replace(statement, revision=revision),
            replace(solution, revision=revision),
        )
        self._keep(inspection_id, statement, forgotten, solution)
        self._live.corrected(inspection_id)
        return True

    def newest(self, inspection_id: str) -> Adjusted:
        """Return the last solution, however old, without solving."""
        return self._last_solution(inspection_id).adjusted

    def adjusted(self, inspection_id: str) -> Adjusted:
        """Return the newest solution; the last frames of a running inspection may be missing from
        it.
        """
        return self._solution(inspection_id).adjusted

    def notices(self, inspection_id: str) -> list[Notice]:
        """Return where picture and rig disagree, by the last solution, without solving."""
        return notices_of(self.newest(inspection_id), self._tracks.tilt(inspection_id))

    def budget(self, inspection_id: str, frame: int | None) -> UncertaintyBudget | None:
        """Return the sources of the interval of a frame, by default the furthest; see `budget_of`.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        adjusted, raw = self.adjusted(inspection_id), self._tracks.get(inspection_id)
        if not len(raw):
            return None
        far = int(adjusted.extended(raw).distance_mm.argmax())
        return budget_of(adjusted, raw, far if frame is None else frame)

    def forget(self, inspection_id: str) -> None:
        """Drop what is held in memory: the rig or the run is another one."""
        with self._lock:
            self._forgotten += 1
            self._statements.pop(inspection_id, None)
            self._solutions.pop(inspection_id, None)
            self._solving.pop(inspection_id, None)

    def track(self, inspection_id: str) -> Track:
        """Return the corrected track so far, possibly empty."""
        adjusted = self.adjusted(inspection_id)
        _, is_growing = self._tracks.run(inspection_id)
        return adjusted.extended(self._tracks.get(inspection_id)) if is_growing else adjusted.track

    def at(self, inspection_id: str, frame: int | None) -> Estimate | None:
        """Return the corrected estimate of a frame, or of the newest; None if it is not tracked."""
        raw = self._tracks.get(inspection_id)
        estimate = estimate_at(raw, len(raw) - 1 if frame is None else frame)
        return None if estimate is None else self.estimate(inspection_id, estimate)

    def initial_pose(self, inspection_id: str) -> InitialPose:
        """Return the pose of the camera in the pipe at the first frame; no correction moves it."""
        return self._tracks.initial_pose(inspection_id)

    def estimate(self, inspection_id: str, raw: Estimate) -> Estimate:
        """Correct the estimate of a frame that was just tracked, without solving."""
        return self._last_solution(inspection_id).adjusted.estimate(raw)

    def chainage_mm(self, inspection_id: str, raw_mm: float) -> float:
        """Return the corrected distance of a raw one, without solving."""
        return self._last_solution(inspection_id).adjusted.chainage_mm(raw_mm)

    def revision(self, inspection_id: str) -> int:
        """Return the revision, which rises with every correction.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return self._statement(inspection_id).revision

    def is_stated(self, inspection: Inspection) -> bool:
        """Return whether any statement moves distances."""
        stated = Stated.from_json(inspection.corrections)
        return stated not in (Stated(), Stated(joints=Joints(use=False)))

    def end(self, inspection: Inspection) -> tuple[float, float | None] | None:
        """Return distance and sigma, mm, of the last frame of an ended inspection, or None.

        The sigma is None if another program measured the survey.
        """
        if inspection.distance_mm is None:
            return None
        if inspection.sigma_distance_mm is None and not self.is_stated(inspection):
            return inspection.distance_mm, None
        if inspection.corrected_mm is not None and inspection.sigma_corrected_mm is not None:
            return inspection.corrected_mm, inspection.sigma_corrected_mm
        try:
            track = self.track(inspection.id)
        except DamagedTrack:  # whoever reads it is told; a list has other inspections to show
            return None
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
            self._store.record_corrected_end(
                inspection.id, inspection.revision, distance_mm, sigma_mm
            )
        except (Busy, DiskFull) as error:  # it is computed again the next time
            logger.warning("The corrected end of %s could not be kept: %s", inspection.id, error)

    def _last_solution(self, inspection_id: str) -> _Solution:
        """Return the last solution of this revision and run, however old."""
        known = self._known(inspection_id)
        if known is not None:
            return known
        with self._being_solved(inspection_id):
            return self._known(inspection_id) or self._solve(inspection_id)

    def _solution(self, inspection_id: str) -> _Solution:
        """Return a solution that is at most some seconds old while the run goes on."""
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
        """Return the cached solution, or None if it is not of this revision and run."""
        statement, run = self._statement(inspection_id), self._tracks.run(inspection_id)
        with self._lock:
            known = self._solutions.get(inspection_id)
        is_current = known is not None and (known.revision, known.run) == (statement.revision, run)
        return known if is_current else None

    def _solve(self, inspection_id: str) -> _Solution:
        """Solve; statements that no longer apply are left out and reported."""
        statement, run = self._statement(inspection_id), self._tracks.run(inspection_id)
        raw = self._tracks.get(inspection_id)
        stated = statement.stated.within(len(raw)) if run[1] else statement.stated
        began_s, refusal = time.monotonic(), None
        try:
            adjusted = self._adjusted(inspection_id, statement.rig, stated, raw)
            error = _refusal(adjusted)
        except InvalidCorrection as failure:
            unadjusted = stated.within(len(raw)).unadjusted()
            adjusted = self._adjusted(inspection_id, statement.rig, unadjusted, raw)
            error, refusal = described(failure), Refusal.of(failure)
        corrected = Corrected(statement.stated, adjusted, error, refusal)
        now_s = time.monotonic()
        solution = _Solution(statement.revision, run, now_s, now_s - began_s, corrected, adjusted)
        self._keep_solution(inspection_id, solution)
        return solution

    def _adjusted(
        self, inspection_id: str, rig: Rig, stated: Stated, raw: Track | None = None
    ) -> Adjusted:
        """Apply statements to the track so far, or to `raw`; see `adjust` for its errors."""
        return adjust(
            self._tracks.get(inspection_id) if raw is None else raw,
            rig,
            stated,
            self._tracks.sightings(inspection_id),
            self._counters.readings(inspection_id),
        )

    def _statement(self, inspection_id: str) -> _Statement:
        with self._lock:
            known, forgotten = self._statements.get(inspection_id), self._forgotten
        if known is not None:
            return known
        row = self._inspections.get(inspection_id)
        stated = Stated.from_json(row.corrections)
        statement = _Statement(row.revision, stated, Rig.model_validate(row.rig))
        self._keep(inspection_id, statement, forgotten)
        return statement

    def _keep(
        self,
        inspection_id: str,
        statement: _Statement,
        forgotten: int,
        solution: _Solution | None = None,
    ) -> None:
        """Keep a statement and its solution unless another thread has kept a newer one.

        Args:
            inspection_id: The inspection.
            statement: The statement; its rig may be the former one if `forget` came meanwhile.
            forgotten: `_forgotten` from before the statement was read.
            solution: The solution of the statement.
        """
        with self._lock:
            if forgotten != self._forgotten:
                return
            known = self._statements.get(inspection_id)
            if known is None or known.revision <= statement.revision:
                self._statements[inspection_id] = statement
        if solution is not None:
            self._keep_solution(inspection_id, solution)

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
