"""What the pictures of a film show: where its camera looks, and the burnt-in counter."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from cachetools import LRUCache

from app.burnt_in.readings import BurntIn
from app.errors import PixelOutsidePicture
from app.inspections.films.filmed import Filmed
from app.inspections.films.uploads import Uploads
from app.jobs.requests.media import AxisFound
from app.tracking.pictures.counter_queue import CounterQueue
from app.tracking.pictures.media import Media, called
from vo_core import Pose, Rig
from vo_core.geometry.gaze import gaze
from vo_core.geometry.grid import Grid, grid
from vo_core.geometry.ruling import Ruling, ruling
from vo_core.geometry.wall import robot_pixels

if TYPE_CHECKING:
    from vo_core.advice import Advice

_FILMS_KEPT = 256

USUAL_SPEED_MM_S = 100.0
"""Speed of a crawler in a culvert, by which a rig is judged before it drives."""

USUAL_RATE_HZ = 25.0
"""Frame rate of most inspection cameras, for the same."""


@dataclass(frozen=True)
class Aim:
    """Where a camera looks, and the wall that it sees then."""

    axis_uv: tuple[float, float] | None
    """Pixel of the pipe's axis; None if the picture does not show it."""
    pitch_deg: float
    """The mount's pitch, nose up."""
    right_deg: float
    """How far it looks to the right; no part of a rig, the tracker estimates it."""
    grid: Grid


@dataclass(frozen=True)
class Film:
    """A film that lies on the server."""

    kind: Literal["upload", "inspection"]
    id: str


class Aiming:
    """Shows pictures of a film, what a rig makes of them, and the counter."""

    def __init__(
        self, uploads: Uploads, filmed: Filmed, media: Media, counters: CounterQueue
    ) -> None:
        self._uploads = uploads
        self._filmed = filmed
        self._media = media
        self._counters = counters
        self._lock = threading.Lock()
        """Guards the next field."""
        self._clearest: LRUCache[Film, AxisFound] = LRUCache(_FILMS_KEPT)
        """The search in a whole film takes seconds, and several parts of a page ask for it."""

    def axis(self, film: Film, t_s: float | None) -> AxisFound:
        """Find the axis of the pipe in the frame shown at `t_s`, or where a film shows it best.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InspectionNotFound, NothingRecorded: There is no film.
            UnreadableVideo: The file has no picture, or ends before that time.
        """
        with self._lock:
            known = self._clearest.get(film) if t_s is None else None
        if known is not None:
            return known
        with self._opened(film) as (path, may_begin_anew):
            found = self._media.axis(path, t_s, may_begin_anew=may_begin_anew)
        if t_s is None:
            with self._lock:
                self._clearest[film] = found
        return found

    def picture(self, film: Film, t_s: float | None) -> bytes:
        """Return the frame shown at `t_s`, or the first one, as JPEG.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InspectionNotFound, NothingRecorded: There is no film.
            UnreadableVideo: The file has no picture, or ends before that time.
        """
        with self._opened(film) as (path, may_begin_anew):
            return self._media.picture(path, t_s, may_begin_anew=may_begin_anew)

    @contextmanager
    def _opened(self, film: Film) -> Iterator[tuple[Path, bool]]:
        """The file of a film, and whether its time stamps may begin anew."""
        if film.kind == "upload":
            with self._uploads.held(film.id) as (path, info), called(path, info.filename):
                yield path, False
        else:
            inspection = self._filmed.inspection(film.id)
            with self._filmed.film(inspection).local() as path:
                yield path, inspection.may_begin_anew

    def counter(self, upload_id: str) -> BurntIn:
        """Find the burnt-in counter of a complete upload.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            UnreadableVideo: The file has no picture.
            MediaTimeout, MediaFailed: The search took too long, or its process died.
        """
        with self._uploads.held(upload_id) as (path, _):
            complete = path
        # Not held meanwhile: an inspection can be made of it, and nobody waits for the answer then.
        return self._counters.search(complete)

    def aim(self, stated: Mapping[str, Any], axis_uv: tuple[float, float] | None) -> Aim:
        """Aim a rig's camera so that it sees the pipe's axis at a pixel; None: as the rig says.

        Raises:
            InvalidRig: The text names field, value and the allowed values.
            PixelOutsidePicture: The lens sees nothing there.
        """
        rig = Rig.parse(dict(stated))
        if axis_uv is None:
            return Aim(_axis_of(rig), rig.mount.pitch_deg, 0.0, grid(rig))
        yaw_rad, pitch_rad = gaze(rig, axis_uv, roll_rad=0.0).tolist()
        if not np.isfinite([yaw_rad, pitch_rad]).all():
            raise PixelOutsidePicture("The lens of this rig sees nothing at the axis.")
        # Pitch is the mount's outermost turn, so the two pitches add up.
        pitch_deg = rig.mount.pitch_deg + float(np.degrees(pitch_rad))
        mount = rig.mount.model_copy(update={"pitch_deg": pitch_deg})
        aimed = rig.model_copy(update={"mount": mount})
        right_deg = float(np.degrees(yaw_rad))
        return Aim(axis_uv, pitch_deg, right_deg, grid(aimed, Pose(yaw_rad=yaw_rad)))

    def ruling(self, stated: Mapping[str, Any]) -> Ruling:
        """Rule the wall in the picture of a rig's camera.

        Raises:
            InvalidRig: The text names field, value and the allowed values; or it sees no wall.
        """
        return ruling(Rig.parse(dict(stated)))

    def advice(self, stated: Mapping[str, Any]) -> Advice:
        """Judge a rig at the usual speed and frame rate; it takes some tenths of a second.

        Raises:
            InvalidRig: The text names field, value and the allowed values; or it sees no wall.
        """
        from vo_core.advice import advise  # loads the odometry

        move = Pose(x_mm=USUAL_SPEED_MM_S / USUAL_RATE_HZ)
        return advise(Rig.parse(dict(stated)), move, USUAL_RATE_HZ)


def _axis_of(rig: Rig) -> tuple[float, float] | None:
    """Pixel of the pipe's axis, if the picture shows it."""
    ((u, v),) = robot_pixels(rig, np.array([[1.0, 0.0, 0.0]])).tolist()
    camera = rig.camera
    is_shown = -0.5 <= u <= camera.width - 0.5 and -0.5 <= v <= camera.height - 0.5
    return (u, v) if is_shown else None
