"""The rig of a camera that looks along the pipe, by the first picture of its film."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.errors import PixelOutsidePicture
from app.inspections.uploads import Uploads
from app.jobs.messages import FirstPicture
from app.tracking.media import Media
from vo_core import Rig
from vo_core.geometry.gaze import gaze
from vo_core.geometry.grid import Grid, grid


@dataclass(frozen=True)
class Aim:
    """Where the camera looks if the pipe's axis is at a pixel, and the wall that it sees then."""

    pitch_deg: float
    """The mount's pitch, nose up."""
    right_deg: float
    """How far it looks to the right; no part of a rig, the tracker estimates it."""
    grid: Grid


class Aiming:
    """Shows the first picture of an upload, and what a rig makes of it."""

    def __init__(self, uploads: Uploads, media: Media) -> None:
        self._uploads = uploads
        self._media = media

    def first_picture(self, upload_id: str) -> FirstPicture:
        """Return the first picture of a complete upload, with the pipe's axis if it shows.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            UnreadableVideo: The file has no picture.
        """
        with self._uploads.held(upload_id) as (path, info):
            return self._media.first_picture(path, info.filename)

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
        return Aim(pitch_deg, float(np.degrees(yaw_rad)), grid(aimed, yaw_rad))
