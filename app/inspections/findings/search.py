"""Searches the walls of inspections, one after the other, while or after they are tracked.

What waits stands in the database, so that a server that ends in the middle searches again. The
tracker has priority: what nobody has asked for is searched while no film waits, by a child that
gets what processor time others leave.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from app.errors import InspectionNotFound, NotRunning
from app.inspections.findings.finder import BLOCK_TILES, Finder, Found
from app.inspections.findings.sighting import places_on_track, seen_best_of
from app.inspections.observations import Observations
from app.storage.database.tables import ENDED, Inspection
from app.storage.records.findings import FindingStore, new_finding
from app.storage.records.inspections import InspectionStore, require_unlocked
from app.survey.findings.records import CLASSICAL, SearchStatus
from app.survey.observations.review import APPROVED
from app.tracking.live import Event, Live, Update, WallChanged
from app.tracking.worker import HINDRANCES, InspectionWorker
from vo_core.errors import ChainageError

logger = logging.getLogger(__name__)

MOST = 5000
"""Findings of one search that are kept, the surest first."""
_LEAST_BLOCKS = 2
"""Blocks that are searched at a time while the robot drives: to start a process takes a second."""
_STOP_TIMEOUT_S = 10.0


@dataclass
class _Wall:
    """The wall of an inspection that is being tracked."""

    painted: set[int] = field(default_factory=set)
    """Tiles that a run has painted."""
    newest: frozenset[int] = frozenset()
    """Those of the last change, which may change again."""
    searched: set[int] = field(default_factory=set)
    """Blocks."""

    def note(self, indices: Iterable[int]) -> None:
        """Take note of tiles that were painted."""
        self.newest = frozenset(indices)
        self.painted |= self.newest

    def due(self) -> list[int]:
        """Return the blocks that are complete and not searched; none while they are few."""
        near = {tile // BLOCK_TILES for each in self.newest for tile in (each - 1, each, each + 1)}
        blocks = {tile // BLOCK_TILES for tile in self.painted} - near - self.searched
        return sorted(blocks) if len(blocks) >= _LEAST_BLOCKS else []


class FindingSearch(InspectionWorker):
    """A thread that has one wall searched at a time."""

    def __init__(
        self,
        inspections: InspectionStore,
        store: FindingStore,
        observations: Observations,
        finder: Finder,
        live: Live,
        *,
        is_automatic: bool,
        has_others: Callable[[], bool],
    ) -> None:
        """Prepare the thread.

        Args:
            inspections, store, observations: What is searched, and what is known.
            finder: Searches one wall.
            live: Told about findings.
            is_automatic: Whether walls are searched that nobody has asked for.
            has_others: Whether films wait to be tracked.
        """
        super().__init__("findings", stop_timeout_s=_STOP_TIMEOUT_S)
        self._inspections = inspections
        self._store = store
        self._observations = observations
        self._finder = finder
        self._live = live
        self._is_automatic = is_automatic
        self._has_others = has_others
        self._inherits = True
        """Whether to look for what waited when the server ended."""
        self._walls: dict[str, _Wall] = {}
        """Of inspections that are being tracked; `_changed` guards this and the next fields."""
        self._begun: set[str] = set()
        """Inspections whose tracking has begun anew, or ended."""
        self._searching: str | None = None
        self._searched_to_mm: float | None = None
        self._is_stopped = threading.Event()

    def stop(self) -> None:
        """End the child; its wall is searched again at the next start."""
        with self._changed:
            self._stopping = True
            self._is_stopped.set()
        super().stop()

    def on_event(self, event: Event) -> None:
        """Follow the tracking: its beginning, each part of the wall, its end."""
        if isinstance(event, WallChanged):
            with self._changed:
                wall = self._walls.setdefault(event.inspection_id, _Wall())
                wall.note(event.indices)
                is_due = bool(wall.due())
            if is_due and self._is_automatic:
                self.announce(event.inspection_id)
        elif isinstance(event, Update):
            is_first = event.state == "running" and not (
                event.estimates or event.progress.frames_done
            )
            if is_first or event.state in ENDED:
                with self._changed:
                    self._walls.pop(event.inspection_id, None)
                    self._begun.add(event.inspection_id)
                    if self._searching == event.inspection_id:
                        self._is_stopped.set()
                self.announce(event.inspection_id)

    def status(self, inspection_id: str) -> SearchStatus:
        """Return how far the search of an inspection is.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        with self._changed:
            is_now, to_mm = self._searching == inspection_id, self._searched_to_mm
        stored = self._store.search(inspection_id)
        if not (is_now and stored.state == "waiting"):
            return stored
        return replace(stored, state="searching", searched_to_mm=to_mm)

    def ask(self, inspection_id: str, detector: str) -> None:
        """Search a wall with this detector, next.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            DetectorNotFound: There is no such model.
        """
        require_unlocked(self._inspections.get(inspection_id))
        self._finder.require(detector)
        self._put(inspection_id, SearchStatus("waiting", detector))
        self.announce(inspection_id, is_asked=True)

    def cancel(self, inspection_id: str, who: str) -> None:
        """Stop the search of a wall, also that of its next parts.

        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            NotRunning: It is neither waiting nor searched.
        """
        require_unlocked(self._inspections.get(inspection_id))
        stored = self._store.search(inspection_id)
        if stored.state != "waiting":
            raise NotRunning("The wall is not being searched; there is nothing to stop.")
        self._put(inspection_id, replace(stored, state="none", detail=f"Stopped by {who}."))

    def _put(self, inspection_id: str, status: SearchStatus) -> None:
        """Store a state that a person wants, and stop what is searched for another one."""
        self._store.put_search(inspection_id, status)
        with self._changed:
            if self._searching == inspection_id:
                self._is_stopped.set()
        self._live.findings_changed(inspection_id)

    def _step(self) -> float | None:
        if self._inherits:
            for inspection_id in self._store.waiting():
                self.announce(inspection_id)
            self._inherits = False
        return super()._step()

    def _may_take(self, *, is_asked: bool) -> bool:
        return is_asked or not self._has_others()

    def _look_at(self, inspection_id: str) -> None:
        """Search a wall that has ended, or the new part of one that grows."""
        row = self._inspections.get(inspection_id)
        if row.review_state == APPROVED:
            return
        status = self._wanted(row)
        if status.state != "waiting":
            return
        if row.status in ENDED:
            self._search(row, status, None)
            return
        with self._changed:
            wall = self._walls.get(inspection_id)
            blocks = wall.due() if wall else []
        if wall and blocks and not self._is_shedding(inspection_id):
            self._search(row, status, blocks)
            wall.searched.update(blocks)

    def _wanted(self, row: Inspection) -> SearchStatus:
        """Return the stored state, in which a search waits if one is to be done by itself."""
        status = self._store.search(row.id)
        with self._changed:
            has_begun = row.id in self._begun
            self._begun.discard(row.id)
        is_running = row.status not in ENDED
        is_new = status == SearchStatus() or (is_running and status.state in ("done", "failed"))
        if (
            self._is_automatic
            and (is_new or (is_running and has_begun))
            and (has_begun or is_running)
        ):
            status = SearchStatus("waiting", CLASSICAL)
            self._store.put_search(row.id, status)
        return status

    def _is_shedding(self, inspection_id: str) -> bool:
        """Whether the machine cannot follow the camera even without this search."""
        newest = self._live.newest(inspection_id)
        return newest is not None and newest.camera is not None and bool(newest.camera.shed)

    def _search(self, row: Inspection, status: SearchStatus, blocks: list[int] | None) -> None:
        """Have a wall searched, or these blocks of it, and keep what is found."""
        with self._changed:
            if self._stopping:
                return
            self._searching, self._searched_to_mm = row.id, None
            self._is_stopped.clear()
        self._live.findings_changed(row.id)
        try:
            result = self._finder.search(
                row, status.detector or CLASSICAL, blocks, self._is_stopped.is_set, self._note
            )
            self._keep(row.id, status, result, is_whole=blocks is None)
        except (*HINDRANCES, InspectionNotFound):
            raise
        except (ChainageError, FileNotFoundError) as failure:
            if not self._is_stopped.is_set():
                logger.warning("The wall of inspection %s: %s", row.id, failure)
                failed = replace(status, state="failed", detail=str(failure))
                self._store.settle(row.id, (), {}, before=status, after=failed)
        finally:
            with self._changed:
                self._searching = None
        self._live.findings_changed(row.id)

    def _note(self, to_mm: float) -> None:
        with self._changed:
            self._searched_to_mm = to_mm

    def _keep(
        self, inspection_id: str, status: SearchStatus, result: Found, *, is_whole: bool
    ) -> None:
        kept = sorted(result.proposals, key=lambda each: -each.score)[:MOST]
        detail = None
        if len(kept) < len(result.proposals):
            detail = f"{len(result.proposals)} were found; the {MOST} surest are kept."
        trajectory = self._observations.trajectory(inspection_id)
        found = [
            new_finding(
                inspection_id, each, result.detector, (seen.frame, seen.pixel) if seen else None
            )
            for each, seen in zip(kept, seen_best_of(trajectory, kept), strict=True)
        ]
        known = places_on_track(trajectory, self._store.listed(inspection_id))
        after = replace(status, detail=detail, searched_to_mm=result.to_mm)
        self._store.settle(
            inspection_id,
            found,
            known,
            before=status,
            after=replace(after, state="done") if is_whole else after,
            replaces=result.detector[0] if is_whole else None,
        )
