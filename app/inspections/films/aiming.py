"""What the first pictures of a film show: where its camera looks, and the burnt-in counter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.burnt_in.readings import BurntIn
from app.errors import PixelOutsidePicture
from app.inspections.films.uploads import Uploads
from app.jobs.requests.media import FirstPicture
from app.tracking.pictures.counter_queue import CounterQueue
from app.tracking.pictures.media import Media
from vo_core import Pose, Rig
from vo_core.geometry.gaze import gaze
from vo_core.geometry.grid import Grid, grid
from vo_core.geometry.ruling import Ruling, ruling

if TYPE_CHECKING:
    from vo_core.advice import Advice

USUAL_SPEED_MM_S = 100.0
"""Speed of a crawler in a culvert, by which a rig is judged before it drives."""

USUAL_RATE_HZ = 25.0
"""Frame rate of most inspection cameras, for the same."""


@dataclass(frozen=True)
class Aim:
    """Where the camera looks if the pipe's axis is at a pixel, and the wall that it sees then."""

    pitch_deg: float
    """The mount's pitch, nose up."""
    right_deg: float
    """How far it looks to the right; no part of a rig, the tracker estimates it."""
    grid: Grid


class Aiming:
    """Shows the first picture of an upload, what a rig makes of it, and the counter."""

    def __init__(self, uploads: Uploads, media: Media, counters: CounterQueue) -> None:
        self._uploads = uploads
        self._media = media
        self._counters = counters

    def first_picture(self, upload_id: str) -> FirstPicture:
        """Return the first picture of a complete upload, with the pipe's axis if it shows.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            UnreadableVideo: The file has no picture.
        """
        with self._uploads.held(upload_id) as (path, info):
            return self._media.first_picture(path, info.filename)

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

    def aim(self, stated: Mapping[str, Any], axis_uv: tuple[float, float]) -> Aim:
        """Aim a rig's camera so that it sees the pipe's axis at a pixel.

        Raises:
            InvalidRig: The text names field, value and the allowed values.
            PixelOutsidePicture: The lens sees nothing there.
        """
        rig = Rig.parse(dict(stated))
        yaw_rad, pitch_rad = gaze(rig, axis_uv, roll_rad=0.0).tolist()
        if not np.isfinite([yaw_rad, pitch_rad]).all():
            raise PixelOutsidePicture("The lens of this rig sees nothing at the axis.")
        # Pitch is the mount's outermost turn, so the two pitches add up.
        pitch_deg = rig.mount.pitch_deg + float(np.degrees(pitch_rad))
        mount = rig.mount.model_copy(update={"pitch_deg": pitch_deg})
        aimed = rig.model_copy(update={"mount": mount})
        return Aim(pitch_deg, float(np.degrees(yaw_rad)), grid(aimed, Pose(yaw_rad=yaw_rad)))

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
