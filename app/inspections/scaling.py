"""Applies the scale of joints and crests during a run, and records when it moves distances.

Joints count unless somebody states otherwise (see `adjustment.adjust`). Each new joint of a run
triggers a solution. The history records when a scale is first applied, dropped, or changed by more
than its published interval.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

from app.errors import InspectionNotFound
from app.inspections.corrections import Corrections
from app.storage.database.tables import ENDED
from app.storage.records.corrections import CorrectionStore, Rescaling
from app.survey.adjustment.adjusted_track import Adjusted
from app.survey.distances.corrected import reason_of
from app.survey.distances.interval import LEAST_M, U95
from app.survey.observations.records import CHAINAGE
from app.tracking.live import CounterRead, Event, Update
from app.tracking.tracks import Tracks
from app.tracking.worker import HINDRANCES, InspectionWorker
from vo_core.joints.sightings import CREST_EVERY_MM

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class _Published:
    """The last published scale of a run."""

    revision: int
    scale: dict[str, Any] | None
    """Scale by joints; None if they did not count."""
    adjusted: Adjusted | None = None
    """The solution with this scale."""
    sightings: int = 0
    way_mm: float = 0.0


class Scaling(InspectionWorker):
    """A thread that checks inspections as their runs progress."""

    def __init__(self, store: CorrectionStore, tracks: Tracks, corrections: Corrections) -> None:
        super().__init__("scaling", stop_timeout_s=_STOP_TIMEOUT_S)
        self._store = store
        self._tracks = tracks
        self._corrections = corrections
        self._published: dict[str, _Published] = {}

    def on_event(self, event: Event) -> None:
        """Handle an event."""
        if isinstance(event, CounterRead):
            self._corrections.forget(event.inspection_id)
            self.announce(event.inspection_id)
        elif isinstance(event, Update) and (event.estimates or event.state in ENDED):
            self.announce(event.inspection_id)

    def _look_at(self, inspection_id: str) -> None:
        try:
            self._check(inspection_id)
        except InspectionNotFound:
            self._published.pop(inspection_id, None)
        except HINDRANCES:
            raise
        except Exception:  # the next joint triggers another solution
            logger.exception("The scale of inspection %s could not be found.", inspection_id)

    def _check(self, inspection_id: str) -> None:
        published = self._published.get(inspection_id) or self._recorded(inspection_id)
        pipe = self._corrections.newest(inspection_id).rig.pipe
        _, is_running = self._tracks.run(inspection_id)
        if is_running and pipe.segment_length_mm is None and pipe.corrugation is None:
            return
        step_mm = pipe.segment_length_mm or CREST_EVERY_MM
        sightings = len(self._tracks.sightings(inspection_id))
        if is_running:
            way_mm = self._tracks.newest_mm(inspection_id)
            is_new = sightings != published.sightings or way_mm > published.way_mm + step_mm
            if not is_new:
                return
        adjusted = self._corrections.adjusted(inspection_id)
        if adjusted is published.adjusted:  # too early to solve again
            return
        scale = scale_of(adjusted)
        revision = self._corrections.revision(inspection_id)
        if revision == published.revision and is_other(published.scale, scale, adjusted):
            change = Rescaling(
                CHAINAGE, published.scale, scale or _why_not(adjusted), _remark(adjusted)
            )
            if self._corrections.rescaled(inspection_id, change):
                logger.info("Inspection %s: %s", inspection_id, _remark(adjusted))
            revision = self._corrections.revision(inspection_id)
        elif revision == published.revision:
            scale = published.scale
        way_mm = float(adjusted.track.distance_mm.max(initial=0.0))
        self._published[inspection_id] = _Published(revision, scale, adjusted, sightings, way_mm)
        if not is_running:
            del self._published[inspection_id]

    def _recorded(self, inspection_id: str) -> _Published:
        last = self._store.last_rescaled(inspection_id)
        scale = None if last is None else dict(last)
        return _Published(self._corrections.revision(inspection_id), scale)


def scale_of(adjusted: Adjusted) -> dict[str, Any] | None:
    """Return the scale by joints or crests, and what a counter carries, for the history; None if
    they do not count.
    """
    found, carried = adjusted.by_joints, _carried_of(adjusted)
    if found is None:
        return carried
    lower_mm = found.lower_mm
    return {
        "scale": round(found.scale, 6),
        "scale_sigma": round(found.sigma, 6),
        f"{found.ruler}_counted": found.joints,
        "lengths_counted": found.lengths,
        "camera_lower_mm": None if lower_mm is None else round(lower_mm, 1),
        **(carried or {}),
    }


def _carried_of(adjusted: Adjusted) -> dict[str, Any] | None:
    carried = adjusted.carried
    if carried is None or adjusted.carrier != "counter":
        return None
    return {"counter_percent": round(100 * float(carried.is_carried.mean()), 1)}


def is_other(
    published: dict[str, Any] | None, scale: dict[str, Any] | None, adjusted: Adjusted
) -> bool:
    """Return whether a scale moves distances by more than the published interval."""
    if published is None or scale is None:
        return (published is None) != (scale is None)
    if published.get("counter_percent") != scale.get("counter_percent"):
        return True
    if ("scale" in published) != ("scale" in scale):
        return True
    if "scale" not in scale:
        return False
    change = abs(float(scale["scale"]) - float(published["scale"]))
    far_mm = float(abs(adjusted.track.distance_mm).max(initial=0.0))
    return change > U95 * float(published["scale_sigma"]) and change * far_mm > 1000 * LEAST_M


def _why_not(adjusted: Adjusted) -> dict[str, Any] | None:
    """Return why the joints do not count, for readers in other languages."""
    refusal = adjusted.joints_refusal
    return None if refusal is None else {"refusal": reason_of(refusal)}


def _remark(adjusted: Adjusted) -> str:
    by_counter = _carried_of(adjusted)
    said = [] if adjusted.by_joints is None else [str(adjusted.by_joints)]
    if by_counter is not None:
        said.append(f"The counter carries {by_counter['counter_percent']:g} % of the frames.")
    if said:
        return " ".join(said)
    refusal = adjusted.joints_refusal
    return "Neither joints nor a counter count." if refusal is None else refusal.sentence
