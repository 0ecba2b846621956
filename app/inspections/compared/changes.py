"""What has changed since an earlier survey: both walls are aligned in a child, one pair at a time.

What is to be compared and what came of it lies beside the later inspection. It names the tiles that
it was made of: when either film is tracked again, it no longer counts and is made anew.
"""

from __future__ import annotations

import hashlib
import logging
import threading
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import PurePath
from typing import Literal

import msgspec

from app.errors import (
    BlobNotFound,
    InspectionNotFound,
    InvalidRequest,
    NotRunning,
    StillRunning,
)
from app.inspections.compared.differences import Difference, Searched, differences_of
from app.inspections.corrections import Corrections
from app.inspections.observations import rig_of
from app.jobs.messages import Limits, Progress
from app.jobs.process import Child, Died, Refused, Stalled
from app.jobs.requests.comparer import CompareRequest, WallFiles
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.database.tables import ENDED, Inspection
from app.storage.records.findings import FindingStore
from app.storage.records.inspections import InspectionStore
from app.survey.assets.aligned import AlignedSurveys, Tie
from app.tracking.unrolled import Unrolled
from app.tracking.worker import Worker
from vo_core.alignment.wall_map import Direction, Node, WallMap

logger = logging.getLogger(__name__)

CPU_S = 1800
"""Processor time limit; two walls of 500 m take some minutes."""
_STALL_S = 600.0
_STOP_TIMEOUT_S = 10.0

State = Literal["none", "waiting", "working", "done", "failed"]
Failure = Literal["no_wall", "other_pipe", "not_recognised", "process"]


class Kept(msgspec.Struct, frozen=True):
    """A comparison as it is stored."""

    state: Literal["waiting", "done", "failed"]
    walls: str
    """Names the tiles and rigs of both walls."""
    code: Failure | None = None
    detail: str | None = None
    map: WallMap | None = None


@dataclass(frozen=True)
class Comparison:
    """How far a comparison is, and what it shows."""

    state: State
    share: float | None = None
    """Share of the work that is done while it is working."""
    code: Failure | None = None
    detail: str | None = None
    map: WallMap | None = None
    version: str | None = None
    """Another one for other walls."""


class Changes(Worker):
    """A thread that has one pair of walls compared at a time."""

    def __init__(
        self,
        inspections: InspectionStore,
        unrolled: Unrolled,
        corrections: Corrections,
        findings: FindingStore,
        blobs: Blobs,
        limits: Limits,
    ) -> None:
        super().__init__("changes", stop_timeout_s=_STOP_TIMEOUT_S)
        self._inspections = inspections
        self._unrolled = unrolled
        self._corrections = corrections
        self._findings = findings
        self._blobs = blobs
        self._limits = limits
        self._due: list[tuple[str, str]] = []
        """Later and earlier inspection of what waits; `_changed` guards this and the next ones."""
        self._working: tuple[str, str] | None = None
        self._progress: Progress | None = None
        self._child: Child | None = None
        self._is_cancelled = threading.Event()

    def stop(self) -> None:
        """End the child; its pair is compared when somebody looks at it again."""
        self._end_child()
        super().stop()

    def get(self, later_id: str, earlier_id: str) -> Comparison:
        """Return a comparison.

        Raises:
            InspectionNotFound: One of the two does not exist.
        """
        pair = (later_id, earlier_id)
        walls = self._walls(pair)
        kept = self._kept(pair)
        with self._changed:
            if self._working == pair:
                progress = self._progress
                done = progress.done / (progress.total or 1) if progress else 0.0
                return Comparison("working", share=done)
        if kept is None:
            return Comparison("none")
        if kept.state == "waiting" or kept.walls != walls:
            self._announce(pair)  # the server began anew, or a film was tracked again
            return Comparison("waiting")
        return Comparison(
            kept.state, code=kept.code, detail=kept.detail, map=kept.map, version=walls[:16]
        )

    def ask(self, later_id: str, earlier_id: str) -> Comparison:
        """Have two walls compared; what is compared already stays.

        Raises:
            InspectionNotFound: One of the two does not exist.
            InvalidRequest: They are one.
            StillRunning: One of them is being tracked.
        """
        if later_id == earlier_id:
            raise InvalidRequest("An inspection is compared with another one; choose that.")
        for each in (later_id, earlier_id):
            if self._inspections.get(each).status not in ENDED:
                raise StillRunning("Its wall still grows; compare it when tracking has ended.")
        known = self.get(later_id, earlier_id)
        if known.state in ("none", "failed"):
            pair = (later_id, earlier_id)
            self._put(pair, Kept("waiting", self._walls(pair)))
            self._announce(pair)
            return Comparison("waiting")
        return known

    def cancel(self, later_id: str, earlier_id: str) -> None:
        """Give up a comparison that waits or is being made.

        Raises:
            InspectionNotFound: One of the two does not exist.
            NotRunning: It is neither.
        """
        if self.get(later_id, earlier_id).state not in ("waiting", "working"):
            raise NotRunning("These walls are not being compared; there is nothing to stop.")
        pair = (later_id, earlier_id)
        with self._changed:
            self._due = [each for each in self._due if each != pair]
            is_working = self._working == pair
        self._blobs.delete(keys.changes_since(*pair))
        if is_working:
            self._end_child()

    def aligned(self, later_id: str, earlier_id: str) -> AlignedSurveys | None:
        """Return two surveys in register; None unless their walls were aligned."""
        kept = self._kept((later_id, earlier_id))
        if kept is None or kept.map is None or not kept.map.nodes:
            return None
        if kept.walls != self._walls((later_id, earlier_id)):
            return None
        return self.in_metres(later_id, earlier_id, kept.map)

    def alignments(self, ids: Sequence[str]) -> dict[tuple[int, int], AlignedSurveys]:
        """Return which surveys of a list, oldest first, are in register, by their places in it."""
        found = {}
        for later, later_id in enumerate(ids):
            for blob in self._blobs.listed(keys.changes(later_id)):
                earlier_id = PurePath(blob.key).stem
                if earlier_id not in ids[:later]:
                    continue
                aligned = self.aligned(later_id, earlier_id)
                if aligned is not None:
                    found[ids.index(earlier_id), later] = aligned
        return found

    def in_metres(self, later_id: str, earlier_id: str, found: WallMap) -> AlignedSurveys:
        """Return a map in the corrected distances of both surveys."""

        def tie(node: Node) -> Tie:
            girth_mm = found.girth_mm
            return Tie(
                self._corrections.chainage_mm(later_id, node.axial_mm) / 1000,
                self._corrections.chainage_mm(earlier_id, node.earlier_mm) / 1000,
                node.sigma_mm,
                0.0 if girth_mm is None else _turn_h(node.arc_mm, girth_mm, found.direction),
            )

        stretches = [[tie(node) for node in stretch] for stretch in found.stretches]
        return AlignedSurveys(found.direction == "opposite", stretches, found.reach_mm / 1000)

    def differences(
        self, later_id: str, earlier_id: str, found: WallMap
    ) -> list[Difference] | None:
        """Compare the findings of two walls; None unless the same detector has searched both."""
        pair = (later_id, earlier_id)
        searches = [self._findings.search(each) for each in pair]
        detectors = {each.detector if each.state == "done" else None for each in searches}
        if len(detectors) > 1 or detectors == {None}:
            return None
        later, earlier = (
            Searched(
                self._findings.listed(each),
                self._unrolled.layout(rig_of(self._inspections.get(each))),
            )
            for each in pair
        )
        return differences_of(later, earlier, found)

    def _announce(self, pair: tuple[str, str]) -> None:
        with self._changed:
            if pair not in self._due and pair != self._working:
                self._due.append(pair)
        self.wake()

    def _walls(self, pair: tuple[str, str]) -> str:
        """Name what two walls are made of."""
        rows = [self._inspections.get(each) for each in pair]
        made_of = [
            (row.rig, [(tile.index, tile.revision) for tile in self._unrolled.tiles(row.id)])
            for row in rows
        ]
        return hashlib.sha256(msgspec.json.encode(made_of)).hexdigest()

    def _kept(self, pair: tuple[str, str]) -> Kept | None:
        try:
            return msgspec.json.decode(self._blobs.get(keys.changes_since(*pair)), type=Kept)
        except (BlobNotFound, msgspec.MsgspecError):  # an older version wrote it
            return None

    def _put(self, pair: tuple[str, str], kept: Kept) -> None:
        self._blobs.put(keys.changes_since(*pair), msgspec.json.encode(kept))

    def _step(self) -> float | None:
        with self._changed:
            if not self._due:
                return None
            pair = self._working = self._due.pop(0)
            self._progress = None
            self._is_cancelled.clear()
        try:
            self._compare(pair)
        except InspectionNotFound:
            logger.debug("One of the inspections %s and %s was deleted meanwhile.", *pair)
        finally:
            with self._changed:
                self._working = self._child = None
        return 0.0

    def _compare(self, pair: tuple[str, str]) -> None:
        """Compare a pair, and store what came of it unless it is no longer wanted."""
        walls = self._walls(pair)
        done = self._compared(pair, walls)
        if done is None or self._stopping or self._is_cancelled.is_set():
            return
        for each in pair:
            self._inspections.get(each)  # raises if it was deleted meanwhile
        self._put(pair, done)
        logger.info("Inspection %s against %s: %s %s", *pair, done.state, done.detail or "")

    def _compared(self, pair: tuple[str, str], walls: str) -> Kept | None:
        rows = [self._inspections.get(each) for each in pair]
        if not all(self._unrolled.tiles(row.id) for row in rows):
            return Kept("failed", walls, "no_wall", "One of the surveys has no unrolled wall.")
        with ExitStack() as held:
            later, earlier = (self._files(row, held) for row in rows)
            request = CompareRequest(earlier, later, self._limits)
            try:
                found = self._asked(request)
            except Refused as refusal:
                refusal.log("Comparing the walls")
                is_other = refusal.code == "invalid_rig"
                return Kept("failed", walls, "other_pipe" if is_other else "process", str(refusal))
            except (Stalled, Died) as fault:
                if self._is_cancelled.is_set() or self._stopping:
                    return None
                return Kept("failed", walls, "process", f"Comparing the walls failed: {fault}.")
        if not found.nodes:
            detail = "The walls show nothing that is certainly the same place."
            return Kept("failed", walls, "not_recognised", detail, found)
        return Kept("done", walls, map=found)

    def _asked(self, request: CompareRequest) -> WallMap:
        with Child("app.jobs.requests.comparer") as child:
            with self._changed:
                self._child = child
                if self._stopping:
                    child.terminate()

            def note(progress: Progress) -> None:
                with self._changed:
                    self._progress = progress

            return child.ask(request, WallMap, stall_s=_STALL_S, part=Progress, on_part=note)

    def _files(self, row: Inspection, held: ExitStack) -> WallFiles:
        tiles = {}
        for tile in self._unrolled.tiles(row.id):
            local = self._blobs.local(keys.tile(row.id, tile.index))
            tiles[tile.index] = str(held.enter_context(local))
        return WallFiles(rig_of(row).model_dump(mode="json"), tiles)

    def _end_child(self) -> None:
        with self._changed:
            self._is_cancelled.set()
            if self._child is not None:
                self._child.terminate()


def _turn_h(arc_mm: float, girth_mm: float, direction: Direction) -> float:
    """Return `Tie.turn_h`. The hour is 6 - 12 arc / girth, as the right of the invert is before 6.

    With arc_e = arc_l + d, hour_e = hour_l - 12 d / girth; with arc_e = d - arc_l,
    hour_e = 12 - hour_l - 12 d / girth.
    """
    turned_h = -12 * arc_mm / girth_mm
    return turned_h if direction == "same" else 12 + turned_h
