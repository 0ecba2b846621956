"""Brings runs to scale by their joints while they go on, and records when that moves distances.

Joints count by themselves as long as nobody states otherwise (see `adjustment.adjust`).  Here runs
are watched: each new joint is solved for, and when the scale comes into force, goes, or changes by
more than the interval that was told, it stands in the history.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

from app.errors import Busy, DiskFull, InspectionNotFound
from app.inspections.corrections import Corrections
from app.storage.inspections import InspectionStore, Rescaling
from app.storage.tables import ENDED
from app.survey.adjustment import Adjusted
from app.survey.corrected import reason_of
from app.survey.interval import LEAST_M, U95
from app.tracking.live import Event, Update
from app.tracking.tracks import Tracks
from app.tracking.worker import Worker

logger = logging.getLogger(__name__)

WHO = "Chainage"
"""In the history: nobody has stated it."""

_STOP_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class _Told:
    """What was last told of a run."""

    revision: int
    scale: dict[str, Any] | None
    """By joints; None if they did not count."""
    adjusted: Adjusted | None = None
    """The solution that says so."""
    sightings: int = 0
    way_mm: float = 0.0


class Scaling(Worker):
    """A thread that looks at runs when they have gone on."""

    def __init__(
        self, inspections: InspectionStore, tracks: Tracks, corrections: Corrections
    ) -> None:
        super().__init__("scaling", stop_timeout_s=_STOP_TIMEOUT_S)
        self._inspections = inspections
        self._tracks = tracks
        self._corrections = corrections
        self._due: dict[str, str] = {}
        """State of runs that have gone on."""
        self._told: dict[str, _Told] = {}

    def on_event(self, event: Event) -> None:
        """A listener of all events."""
        if isinstance(event, Update) and (event.estimates or event.state in ENDED):
            with self._changed:
                self._due[event.inspection_id] = event.state
                self._changed.notify_all()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._due or self._stopping)
                if self._stopping:
                    return
                due, self._due = self._due, {}
            for inspection_id, state in due.items():
                try:
                    self._look(inspection_id, has_ended=state in ENDED)
                except InspectionNotFound:  # deleted meanwhile
                    self._told.pop(inspection_id, None)
                except (Busy, DiskFull) as fault:
                    logger.warning(
                        "The scale of %s could not be recorded: %s", inspection_id, fault
                    )
                except Exception:
                    logger.exception(
                        "The scale of inspection %s could not be found.", inspection_id
                    )

    def _look(self, inspection_id: str, *, has_ended: bool) -> None:
        told = self._told.get(inspection_id) or self._recorded(inspection_id)
        segment_mm = self._corrections.newest(inspection_id).rig.pipe.segment_length_mm
        if segment_mm is None:
            return
        sightings = len(self._tracks.sightings(inspection_id))
        if not has_ended:
            way_mm = self._tracks.newest_mm(inspection_id)
            is_new = sightings != told.sightings or way_mm > told.way_mm + segment_mm
            if not is_new:
                return
        adjusted = self._corrections.adjusted(inspection_id)
        if adjusted is told.adjusted:  # it is too early to solve it again
            return
        scale = scale_of(adjusted)
        revision = self._corrections.revision(inspection_id)
        if revision == told.revision and is_other(told.scale, scale, adjusted):
            change = Rescaling(WHO, told.scale, scale or _why_not(adjusted), _remark(adjusted))
            if self._corrections.rescaled(inspection_id, change):
                logger.info("Inspection %s: %s", inspection_id, _remark(adjusted))
            revision = self._corrections.revision(inspection_id)
        elif revision == told.revision:
            scale = told.scale
        way_mm = float(adjusted.track.distance_mm.max(initial=0.0))
        self._told[inspection_id] = _Told(revision, scale, adjusted, sightings, way_mm)
        if has_ended:
            del self._told[inspection_id]

    def _recorded(self, inspection_id: str) -> _Told:
        last = self._inspections.last_rescaled(inspection_id)
        scale = None if last is None else dict(last)
        return _Told(self._corrections.revision(inspection_id), scale)


def scale_of(adjusted: Adjusted) -> dict[str, Any] | None:
    """What the joints say, for the record; None if they do not count."""
    found = adjusted.by_joints
    if found is None:
        return None
    lower_mm = found.lower_mm
    return {
        "scale": round(found.scale, 6),
        "scale_sigma": round(found.sigma, 6),
        "joints_counted": found.joints,
        "camera_lower_mm": None if lower_mm is None else round(lower_mm, 1),
    }


def is_other(told: dict[str, Any] | None, scale: dict[str, Any] | None, adjusted: Adjusted) -> bool:
    """Whether it moves distances by more than the interval that was told."""
    if told is None or scale is None:
        return (told is None) != (scale is None)
    change = abs(float(scale["scale"]) - float(told["scale"]))
    far_mm = float(abs(adjusted.track.distance_mm).max(initial=0.0))
    return change > U95 * float(told["scale_sigma"]) and change * far_mm > 1000 * LEAST_M


def _why_not(adjusted: Adjusted) -> dict[str, Any] | None:
    """Why the joints do not count, for who reads the record in another language."""
    refusal = adjusted.joints_refusal
    return None if refusal is None else {"refusal": reason_of(refusal)}


def _remark(adjusted: Adjusted) -> str:
    if adjusted.by_joints is not None:
        return str(adjusted.by_joints)
    refusal = adjusted.joints_refusal
    return "The joints no longer count." if refusal is None else refusal.sentence
