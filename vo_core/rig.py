"""The rig file: camera, mount and pipe, checked field by field."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from vo_core.errors import InvalidRig, RigVideoMismatch
from vo_core.types import Matrix


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @classmethod
    def parse(cls, fields: object, *, origin: str = "the rig") -> Self:
        """Check fields that come from a file or a request; `origin` names where from.

        Raises:
            InvalidRig: A value that is not allowed; the text names field, value and what is
            allowed.
        """
        try:
            return cls.model_validate(fields)
        except ValidationError as error:
            reasons = []
            for fault in error.errors(include_url=False):
                field = ".".join(map(str, fault["loc"])) or origin
                value = fault["input"]
                found = "" if isinstance(value, dict) else f" (found {value!r})"
                reasons.append(f"{field}: {fault['msg'].removeprefix('Value error, ')}{found}")
            raise InvalidRig(f"{origin} cannot be used. " + "; ".join(reasons) + ".") from error


Pixels = Annotated[int, Field(ge=32, le=8192)]


class Camera(_Part):
    """Intrinsics: u = fx X/Z + skew Y/Z + cx, v = fy Y/Z + cy, after the lens distortion."""

    model: Literal["pinhole", "fisheye"] = Field(
        description="pinhole (OpenCV k1 k2 p1 p2 [k3 ...]) or fisheye (OpenCV k1..k4)."
    )
    width: Pixels = Field(description="Width of the picture in px, 32 to 8192.")
    height: Pixels = Field(description="Height of the picture in px, 32 to 8192.")
    fx: float = Field(gt=1, le=100_000, description="Focal length along the rows in px.")
    fy: float = Field(gt=1, le=100_000, description="Focal length along the columns in px.")
    cx: float = Field(ge=-8192, le=16384, description="Principal point in px, centres at integers.")
    cy: float = Field(ge=-8192, le=16384, description="Principal point in px, centres at integers.")
    skew: float = Field(
        0.0, ge=-1000, le=1000, description="Off-diagonal term of K in px, the paper's alpha."
    )
    distortion: list[Annotated[float, Field(ge=-1000, le=1000)]] = Field(
        default_factory=list,
        description="Lens distortion: pinhole 0, 4, 5, 8, 12 or 14 numbers; fisheye 0 or 4.",
    )

    readout_ms: float = Field(
        0.0, ge=0, le=200, description="Rolling shutter: time from first row to last, ms; 0: none."
    )

    @model_validator(mode="after")
    def _distortion_has_a_known_length(self) -> Self:
        allowed = (0, 4) if self.model == "fisheye" else (0, 4, 5, 8, 12, 14)
        if len(self.distortion) not in allowed:
            raise ValueError(
                f"distortion holds {len(self.distortion)} numbers; a {self.model} camera takes "
                f"{', '.join(map(str, allowed[:-1]))} or {allowed[-1]}"
            )
        return self

    @property
    def focal_px(self) -> float:
        """Geometric mean of the two focal lengths."""
        return float(np.sqrt(self.fx * self.fy))

    @property
    def matrix(self) -> Matrix:
        """K, (3, 3), with the skew."""
        return np.array([[self.fx, self.skew, self.cx], [0, self.fy, self.cy], [0, 0, 1]])


class Mount(_Part):
    """Where the camera sits on the robot; the robot frame is x forward, y right, z down."""

    view: Literal["down", "forward"] = Field(
        description="down: optical axis to the invert; forward: along the pipe."
    )
    height_mm: float = Field(
        gt=0, le=10_000, description="Height of the camera above the invert or the floor in mm."
    )
    rotation_deg: float = Field(
        ge=-360,
        le=360,
        description="Turn about the optical axis, robot-forward towards robot-right; "
        "at 0 the right of the picture points forward (view forward: to the robot's right).",
    )
    lateral_mm: float = Field(
        0.0, ge=-5000, le=5000, description="Camera to the right of the pipe's axis in mm."
    )
    pitch_deg: float = Field(
        0.0, ge=-80, le=80, description="Tilt about the robot's y axis, nose up positive."
    )
    roll_deg: float = Field(
        0.0, ge=-80, le=80, description="Tilt about the robot's x axis, right side down positive."
    )


class Pipe(_Part):
    """The wall that the camera looks at."""

    shape: Literal["circular", "flat"] = Field(description="circular pipe, or flat floor.")
    diameter_mm: float | None = Field(
        None, ge=50, le=20_000, description="Inner diameter in mm; circular only, there required."
    )
    segment_length_mm: float | None = Field(
        None, ge=100, le=20_000, description="Length of one pipe segment, joint to joint, in mm."
    )

    @model_validator(mode="after")
    def _diameter_goes_with_circular(self) -> Self:
        if self.shape == "circular" and self.diameter_mm is None:
            raise ValueError("diameter_mm is missing; a circular pipe needs it (50 to 20000 mm)")
        if self.shape == "flat" and self.diameter_mm is not None:
            raise ValueError("diameter_mm is given for a flat floor; leave it out")
        return self


class Tolerance(_Part):
    """How well the rig is known: one standard uncertainty (68 %) each.

    The defaults are those of a tape and a data sheet.
    """

    height_mm: float = Field(2.0, ge=0, le=1000, description="Of the camera's height in mm.")
    tilt_deg: float = Field(1.0, ge=0, le=30, description="Of pitch and of roll of the mount.")
    focal_percent: float = Field(0.5, ge=0, le=20, description="Of the focal length in percent.")
    diameter_mm: float = Field(3.0, ge=0, le=1000, description="Of the pipe's diameter in mm.")
    segment_length_mm: float = Field(
        5.0, ge=0, le=1000, description="Of the length of a pipe segment in mm, alike in all."
    )


class Rig(_Part):
    """Camera, mount and pipe: all that turns pixels into millimetres, and how well it is known."""

    camera: Camera
    mount: Mount
    pipe: Pipe
    tolerance: Tolerance = Tolerance.model_construct()

    @model_validator(mode="after")
    def _camera_is_inside_the_pipe(self) -> Self:
        if self.pipe.diameter_mm is not None:
            radius_mm = self.pipe.diameter_mm / 2
            off_axis_mm = np.hypot(self.mount.lateral_mm, radius_mm - self.mount.height_mm)
            if off_axis_mm >= radius_mm:
                raise ValueError(
                    f"height_mm {self.mount.height_mm:g} with lateral_mm "
                    f"{self.mount.lateral_mm:g} puts the camera outside the pipe of "
                    f"{self.pipe.diameter_mm:g} mm diameter; both must lie within it"
                )
        return self

    @classmethod
    def load(cls, path: Path | str) -> Rig:
        """Read a rig file.

        Raises:
            InvalidRig: No such file, not JSON, or a value that is not allowed; the text names each.
        """
        path = Path(path)
        try:
            return cls.parse(json.loads(path.read_bytes()), origin=path.name)
        except OSError as error:
            raise InvalidRig(f"{path.name} cannot be read: {error.strerror or error}.") from error
        except (ValueError, RecursionError) as error:
            raise InvalidRig(f"{path.name} is not a JSON file: {error}.") from error

    def known_to(self, **tolerance: float) -> Rig:
        """The same rig with these fields of `tolerance` in place of its own."""
        changed = self.tolerance.model_dump() | tolerance
        return self.model_copy(update={"tolerance": Tolerance.parse(changed, origin="tolerance")})

    def require_picture_size(self, width: int, height: int) -> None:
        """Check that pictures of this size can come from the rig's camera.

        Raises:
            RigVideoMismatch: The camera has another picture size.
        """
        if (self.camera.width, self.camera.height) != (width, height):
            raise RigVideoMismatch(
                f"camera.width and camera.height are {self.camera.width} x {self.camera.height}, "
                f"but the video has {width} x {height} px; "
                "the rig must be of the camera that made the video."
            )
