"""Says why the distances of an inspection are of no use, and what repairs that."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.errors import MediaFailed, MediaTimeout, NothingRecorded
from app.inspections.corrections import Corrections
from app.inspections.films.aiming import Aiming, Film
from app.inspections.inspections import Inspections
from app.storage.database.tables import ENDED, Inspection
from app.survey.distances.causes import MANY_LOST, AxisSeen, Cause, causes_of, of_error
from app.survey.distances.film_quality import FilmQuality, quality_of
from app.tracking.tracks import Tracks
from vo_core import Rig
from vo_core.errors import UnreadableVideo

_R95 = math.sqrt(-2 * math.log(0.05))
"""Radius of the circle that holds 95 % of a normal distribution in the plane, in sigmas."""


@dataclass(frozen=True)
class Diagnosed:
    """What was seen, and what probably is wrong."""

    lost_share: float | None
    """None where nothing was tracked; the next one too."""
    weak_share: float | None
    causes: list[Cause]
    """The most probable first; none if the distances are of use, or may still become so."""


class Diagnosis:
    """Looks at the tracks, rigs and pictures of ended inspections."""

    def __init__(
        self, inspections: Inspections, tracks: Tracks, corrections: Corrections, aiming: Aiming
    ) -> None:
        self._inspections = inspections
        self._tracks = tracks
        self._corrections = corrections
        self._aiming = aiming

    def of(self, inspection_id: str) -> Diagnosed:
        """Return the diagnosis of an inspection.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        view = self._inspections.get(inspection_id)
        row = view.row
        track = self._tracks.get(inspection_id)
        quality = quality_of(track, self._tracks.health(inspection_id).columns())
        lost, weak = (quality.lost_share, quality.weak_share) if quality else (None, None)
        if row.status == "failed":
            return Diagnosed(lost, weak, [of_error(row.error_code or "")])
        is_doubtful = view.is_useful is False or (lost or 0.0) > MANY_LOST
        if row.status not in ENDED or not row.has_film or not is_doubtful:
            return Diagnosed(lost, weak, [])
        return Diagnosed(lost, weak, self._causes(row, quality))

    def _causes(self, row: Inspection, quality: FilmQuality | None) -> list[Cause]:
        rig = Rig.parse(dict(row.rig))
        budget = self._corrections.budget(row.id, None)
        largest = budget.parts[0].name if budget and budget.parts else None
        return causes_of(rig, self._axis(row, rig), quality, largest)

    def _axis(self, row: Inspection, rig: Rig) -> AxisSeen:
        try:
            found = self._aiming.axis(Film("inspection", row.id), None)
        except (NothingRecorded, UnreadableVideo, MediaFailed, MediaTimeout):
            return AxisSeen(0, 0)  # a diagnosis without pictures is better than none
        if found.axis_uv is None or found.sigma_px is None or not rig.looks_along_pipe:
            return AxisSeen(found.looked_at, found.sure)
        aim = self._aiming.aim(row.rig, found.axis_uv)
        u95_deg = math.degrees(math.atan(_R95 * found.sigma_px / rig.camera.fx))
        return AxisSeen(found.looked_at, found.sure, aim.pitch_deg, u95_deg)
