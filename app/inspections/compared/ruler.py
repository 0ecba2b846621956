"""An earlier survey's wall as a ruler: where the film of a known culvert is, as a correction.

The offer is made of what people state anyway: where the first recognised frame is, and the lengths
from there to other recognised frames. A person accepts it, with a name and a reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, sqrt

import numpy as np

from app.errors import NothingToMeasureBy
from app.inspections.compared.changes import Changes, Comparison
from app.inspections.corrections import Corrections
from app.storage.database.tables import Inspection
from app.storage.index.asset_index import AssetIndex
from app.storage.records.inspections import InspectionStore
from app.survey.distances.corrected import Corrected
from app.survey.distances.interval import U95, half_width_m
from app.survey.distances.stated import Length, Stated, Zero
from app.survey.fields.header import asset_of, number_of
from app.tracking.tracks import Tracks
from vo_core import Track
from vo_core.alignment.wall_map import Place, WallMap

EVERY_MM = 5000.0
"""Way between two frames whose places are stated; on it the camera measures better."""
_LEAST_MM = 500.0
"""A shorter length states nothing about the scale."""
_MOST_SURVEYS = 20


@dataclass(frozen=True)
class Known:
    """A frame that was recognised on the earlier wall."""

    frame: int
    earlier_m: float
    """Corrected distance of the camera in the earlier survey."""
    u95_m: float
    """Half of its 95 % interval: of the alignment and of the earlier survey."""
    sigma_mm: float
    """Standard uncertainty by the alignment alone."""
    distance_m: float
    """Corrected distance as this survey has it now."""


@dataclass(frozen=True)
class Offer:
    """What the wall of an earlier survey says about the distances of this one."""

    earlier_id: str | None
    """The newest earlier survey of the asset that has ended; None if there is none."""
    comparison: Comparison
    known: Sequence[Known] = ()
    zero: Zero | None = None
    """Where the zero point would be; None if the surveys count from different ends and the length
    of the asset is not known."""
    lengths: Sequence[Length] = ()

    @property
    def is_there(self) -> bool:
        """Whether there is anything to accept."""
        return self.zero is not None or bool(self.lengths)


class WallRuler:
    """Makes offers, and states them when a person accepts."""

    def __init__(
        self,
        inspections: InspectionStore,
        assets: AssetIndex,
        tracks: Tracks,
        corrections: Corrections,
        changes: Changes,
    ) -> None:
        self._inspections = inspections
        self._assets = assets
        self._tracks = tracks
        self._corrections = corrections
        self._changes = changes

    def offer(self, inspection_id: str) -> Offer:
        """Return what the newest earlier survey of the asset says; its walls are compared first.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = self._inspections.get(inspection_id)
        earlier = self._earlier(row)
        if earlier is None:
            return Offer(None, Comparison("none"))
        comparison = self._changes.get(inspection_id, earlier.id)
        if comparison.state != "done" or comparison.map is None:
            return Offer(earlier.id, comparison)
        found = comparison.map
        track = self._tracks.get(inspection_id)
        known = [self._known(row.id, earlier.id, track, *each) for each in _frames(track, found)]
        return Offer(
            earlier.id, comparison, known, _zero(known, found, row, earlier), _lengths(known)
        )

    def accept(
        self, inspection_id: str, earlier_id: str, version: str, reason: str, who: str
    ) -> Corrected:
        """State what is offered, in place of the zero and of the lengths that it contradicts.

        Args:
            inspection_id: The inspection that is corrected.
            earlier_id: The survey by which it is.
            version: `Comparison.version` of the offer that the person saw.
            reason: For the history.
            who: The person.
        Raises:
            InspectionNotFound, InspectionLocked: There is none, or it is approved.
            NothingToMeasureBy: There is no offer, or another one by now.
            InvalidCorrection: It contradicts what else is known; nothing was stored.
        """
        offer = self.offer(inspection_id)
        if offer.earlier_id != earlier_id or offer.comparison.version != version:
            raise NothingToMeasureBy("The offer is another one by now; look at it again.")
        if not offer.is_there:
            raise NothingToMeasureBy("The earlier wall says nothing about this film.")

        def change(stated: Stated) -> Stated:
            frames = {(each.first_frame, each.last_frame) for each in offer.lengths}
            others = [
                each for each in stated.lengths if (each.first_frame, each.last_frame) not in frames
            ]
            return stated.model_copy(
                update={
                    "zero": offer.zero or stated.zero,
                    "lengths": (*others, *offer.lengths),
                }
            )

        return self._corrections.change(inspection_id, change, reason, who)

    def _earlier(self, row: Inspection) -> Inspection | None:
        asset = asset_of(row.header)
        if asset is None:
            return None
        _, found = self._assets.inspections_of(asset, _MOST_SURVEYS)
        ids = [one.row.inspection_id for one in found]
        before = found[: ids.index(row.id)] if row.id in ids else found
        ended = [one.inspection for one in before if one.inspection.status == "done"]
        return ended[-1] if ended else None

    def _known(
        self, inspection_id: str, earlier_id: str, track: Track, frame: int, place: Place
    ) -> Known:
        earlier = self._corrections.adjusted(earlier_id)
        nearest = int(np.abs(earlier.raw.distance_mm - place.axial_mm).argmin())
        both_mm = hypot(place.sigma_mm, float(earlier.track.sigma_distance_mm[nearest]))
        raw_mm = float(track.distance_mm[frame])
        return Known(
            frame,
            earlier.chainage_mm(place.axial_mm) / 1000,
            half_width_m(both_mm),
            place.sigma_mm,
            self._corrections.chainage_mm(inspection_id, raw_mm) / 1000,
        )


def _frames(track: Track, found: WallMap) -> list[tuple[int, Place]]:
    """Choose frames: the first and the last of each stretch, and some between."""
    chosen: list[tuple[int, Place]] = []
    for stretch in found.stretches:
        inside = np.flatnonzero(
            (track.distance_mm >= stretch[0].axial_mm - found.reach_mm)
            & (track.distance_mm <= stretch[-1].axial_mm + found.reach_mm)
            & (track.status != "lost")
        )
        if not inside.size:
            continue
        way_mm = np.abs(track.distance_mm[inside] - track.distance_mm[inside[0]])
        marks_mm = np.arange(0, way_mm.max() + EVERY_MM, EVERY_MM)
        indices = {
            int(inside[min(np.searchsorted(way_mm, mm), inside.size - 1)]) for mm in marks_mm
        }
        for frame in sorted(indices | {int(inside[0]), int(inside[-1])}):
            place = found.earlier(float(track.distance_mm[frame]))
            if place is not None:
                chosen.append((frame, place))
    return sorted(chosen, key=lambda each: each[0])


def _zero(
    known: Sequence[Known], found: WallMap, row: Inspection, earlier: Inspection
) -> Zero | None:
    """Count as the earlier survey does; from the other end by the known length of the asset."""
    if not known:
        return None
    first = known[0]
    if found.direction == "same":
        return Zero(frame=first.frame, offset_m=round(first.earlier_m, 4))
    stated = [number_of(each.header.get("known_length_m")) for each in (row, earlier)]
    length_m = next((each for each in stated if each is not None and each > 0), None)
    if length_m is None:
        return None
    return Zero(frame=first.frame, offset_m=round(length_m - first.earlier_m, 4))


def _lengths(known: Sequence[Known]) -> list[Length]:
    lengths = []
    for before, after in pairwise(known):
        length_m = abs(after.earlier_m - before.earlier_m)
        if 1000 * length_m < _LEAST_MM:
            continue
        # What the earlier survey itself does not know grows along the way.
        earlier_m = sqrt(abs(after.u95_m**2 - before.u95_m**2)) / U95
        sigma_mm = hypot(before.sigma_mm, after.sigma_mm, 1000 * earlier_m)
        lengths.append(
            Length(
                first_frame=before.frame,
                last_frame=after.frame,
                length_m=round(length_m, 4),
                sigma_mm=max(round(sigma_mm, 2), 0.1),
            )
        )
    return lengths
