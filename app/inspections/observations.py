"""Observations: anchored to a frame and a pixel; everything else is derived when they are read."""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping, MutableMapping
from functools import lru_cache
from typing import Any

from cachetools import LRUCache

from app.errors import (
    FrameNotFound,
    FrameOutsideVideo,
    ObservationNotFound,
    PixelOutsidePicture,
)
from app.inspections.corrections import Corrections
from app.storage.database.tables import IMPORTED, Inspection
from app.storage.records.inspections import InspectionStore
from app.storage.records.observations import ObservationStore
from app.survey.distances.track_rows import is_unmeasured
from app.survey.observations.records import Event
from app.survey.observations.tag import StatedTag, Tag, entered
from app.survey.places.measure import Figure, Measure
from app.survey.places.measuring import figure_of, figures_of
from app.survey.places.place import (
    Anchor,
    ObservationView,
    Place,
    Trajectory,
    WallGrid,
    WallUnder,
    place_of,
    places_of,
    wall_grid,
    wall_under,
)
from app.survey.places.stretches import next_stretch_number
from app.survey.versions import Require, require_version
from app.tracking.live import Live
from app.tracking.pictures.videos import NO_FILM
from app.tracking.tracks import Tracks
from vo_core import Rig

logger = logging.getLogger(__name__)

_TRAJECTORIES_KEPT = 8
"""Trajectories held in memory, with the places of their observations."""


class Observations:
    """Stores, lists, deletes and restores observations."""

    def __init__(
        self,
        inspections: InspectionStore,
        store: ObservationStore,
        tracks: Tracks,
        corrections: Corrections,
        live: Live,
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._tracks = tracks
        self._corrections = corrections
        self._live = live
        self._lock = threading.Lock()
        """Guards the next field."""
        self._trajectories: LRUCache[str, Trajectory] = LRUCache(_TRAJECTORIES_KEPT)

    def put(
        self,
        inspection_id: str,
        observation_id: str,
        tag: Tag,
        who: str,
        *,
        replaced: str | None = None,
    ) -> None:
        """Create or replace an observation; it is committed and synced when this returns.

        An equal tag changes nothing; a deleted observation is restored with this tag.

        Args:
            inspection_id, observation_id: The observation.
            tag: Everything entered from now on.
            who: Name for the history.
            replaced: Version that the change was based on; None replaces any version.
        Raises:
            InspectionNotFound: No inspection has this id.
            InspectionLocked: It is approved.
            FrameOutsideVideo, PixelOutsidePicture: The film has no such frame or pixel.
            ChangedMeanwhile: The version is no longer `replaced`; nothing was stored.
        """
        stated = self.checked(inspection_id, tag)
        require = _required(stated.to_json(), replaced)
        if self._store.put(inspection_id, observation_id, stated, who, require):
            self._live.observations_changed(inspection_id)

    def checked(self, inspection_id: str, tag: Tag) -> StatedTag:
        """Return a tag as it is stored.

        Raises:
            InspectionNotFound: No inspection has this id.
            FrameOutsideVideo, PixelOutsidePicture: The film has no such frame or pixel.
        """
        inspection = self._inspections.get(inspection_id)
        track = self._tracks.get(inspection_id)
        check_frame(inspection, len(track), tag.frame)
        if tag.pixel is not None:
            check_pixel(inspection, *tag.pixel)
        for measure in tag.measures or ():
            _check_points(inspection, len(track), measure)
        if tag.pixel and inspection.source_kind == IMPORTED and is_unmeasured(track):
            raise PixelOutsidePicture(f"{NO_FILM} Tag it without a pixel.")
        return StatedTag.kept(tag.model_dump())

    def delete(
        self, inspection_id: str, observation_id: str, who: str, *, replaced: str | None = None
    ) -> None:
        """Delete an observation; it can be restored.

        Args:
            inspection_id, observation_id: The observation.
            who: Name for the history.
            replaced: Version that the person wants to delete; None deletes any version.
        Raises:
            ObservationNotFound: No observation ever had this id.
            InspectionLocked: The inspection is approved.
            ChangedMeanwhile: The version is no longer `replaced`; nothing was deleted.
        """
        require = _required(None, replaced)
        if self._store.delete(inspection_id, observation_id, who, require):
            self._live.observations_changed(inspection_id)

    def restore(self, inspection_id: str, observation_id: str, who: str) -> None:
        """Undo a deletion.

        Raises:
            ObservationNotFound: No observation ever had this id.
            InspectionLocked: The inspection is approved.
        """
        if self._store.restore(inspection_id, observation_id, who):
            self._live.observations_changed(inspection_id)

    def all(self, inspection_id: str) -> list[ObservationView]:
        """Return the observations in the order of their numbers."""
        self._inspections.get(inspection_id)
        rows, trajectory = self._store.listed(inspection_id), self.trajectory(inspection_id)
        places = places_of(trajectory, [row.tag for row in rows])
        return [
            ObservationView(row, place, figures_of(trajectory, row.tag))
            for row, place in zip(rows, places, strict=True)
        ]

    def get(self, inspection_id: str, observation_id: str) -> ObservationView:
        """Return an observation that is not deleted."""
        row = self._store.get(inspection_id, observation_id)
        if row.deleted_at is not None:
            raise ObservationNotFound("This observation was deleted; it can be restored.")
        trajectory = self.trajectory(inspection_id)
        return ObservationView(row, place_of(trajectory, row.tag), figures_of(trajectory, row.tag))

    def wall_at(self, inspection_id: str, frame: int, pixel: tuple[float, float]) -> WallUnder:
        """Return the wall point that a pixel of a tracked frame shows.

        Raises:
            PixelOutsidePicture: The picture has no such pixel.
            FrameNotFound: The frame is not tracked, or no wall is seen there.
        """
        inspection = self._inspections.get(inspection_id)
        check_pixel(inspection, *pixel)
        found = wall_under(self.trajectory(inspection_id), frame, pixel)
        if found is None:
            raise FrameNotFound(
                f"Frame {frame} is not tracked yet, or shows no wall at this pixel."
            )
        return found

    def measured(self, inspection_id: str, measure: Measure) -> Figure:
        """Return the figure of a measure that is not stored.

        Raises:
            FrameOutsideVideo, PixelOutsidePicture: The film has no such frame or pixel.
            FrameNotFound: A frame is not tracked, or the picture cannot show this.
        """
        inspection = self._inspections.get(inspection_id)
        trajectory = self.trajectory(inspection_id)
        _check_points(inspection, len(trajectory.raw), measure)
        figure = figure_of(trajectory, measure)
        if figure is None:
            raise FrameNotFound(
                f"No {measure.kind} can be derived: a frame is not tracked yet, a pixel shows no "
                "wall, or the picture cannot show this."
            )
        return figure

    def wall_grid(self, inspection_id: str) -> WallGrid:
        """Return the rays of a grid of pixels over the picture, with pose 0."""
        return wall_grid(
            rig_of(self._inspections.get(inspection_id)),
            self._tracks.initial_pose(inspection_id),
            self._corrections.adjusted(inspection_id).scale,
        )

    def next_stretch(self, inspection_id: str) -> int:
        """Return the first stretch number that was never used."""
        return next_stretch_number(self._store.stretch_marks(inspection_id))

    def events(self, inspection_id: str, observation_id: str | None = None) -> list[Event]:
        """Return every event of the inspection or of one observation, oldest first.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        self._inspections.get(inspection_id)
        return self._inspections.events(inspection_id, observation_id)

    def trajectory(self, inspection_id: str) -> Trajectory:
        """Return the current trajectory, from which places are derived; what it derives is kept."""
        adjusted = self._corrections.adjusted(inspection_id)
        raw = self._tracks.get(inspection_id)
        initial_pose = self._tracks.initial_pose(inspection_id)
        with self._lock:
            known = self._trajectories.get(inspection_id)
            # During a run rows are only added; existing ones stay.
            places: MutableMapping[Anchor, Place] = {}
            figures: MutableMapping[str, Figure] = {}
            if (
                known is not None
                and known.adjusted is adjusted
                and known.initial_pose == initial_pose
            ):
                places, figures = known.places, known.figures
            trajectory = self._trajectories[inspection_id] = Trajectory(
                adjusted, raw, places, initial_pose, figures
            )
        return trajectory


def _required(yours: Mapping[str, Any] | None, replaced: str | None) -> Require:
    """Return the check of the stored fields before `yours` replaces them."""

    def require(stored: Mapping[str, Any] | None) -> None:
        current = None if stored is None else entered(stored)
        require_version(current, yours, replaced)

    return require


def rig_of(inspection: Inspection) -> Rig:
    """Return the rig of an inspection as an object."""
    return _parsed_rig(Rig.model_validate(inspection.rig).model_dump_json())


@lru_cache(maxsize=32)
def _parsed_rig(text: str) -> Rig:
    return Rig.model_validate_json(text)


def check_pixel(inspection: Inspection, u: float, v: float) -> None:
    """Raise PixelOutsidePicture unless the picture has the pixel; pixel centres are at integers."""
    width, height = inspection.video["width"], inspection.video["height"]
    if not (-0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5):
        raise PixelOutsidePicture(
            f"The pixel ({u:g}, {v:g}) is outside the picture of {width} x {height} px."
        )


def check_frame(inspection: Inspection, tracked: int, frame: int) -> None:
    """Raise FrameOutsideVideo unless the film has the frame; `tracked` is the number so far."""
    total = inspection.video.get("frames")
    if inspection.status == "done":
        limit = tracked
    elif total:
        # Before the end, the number of frames is what the container states: allow some more.
        limit = max(tracked, round(1.1 * total) + 100)
    else:
        limit = frame + 1
    if frame >= limit:
        raise FrameOutsideVideo(f"The video has no frame {frame}; its last one is {limit - 1}.")


def _check_points(inspection: Inspection, tracked: int, measure: Measure) -> None:
    for point in measure.points:
        check_frame(inspection, tracked, point.frame)
        check_pixel(inspection, *point.pixel)
