"""The rig file: camera, mount and pipe, validated field by field."""

from __future__ import annotations

import json
import math
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
        """Validate fields that come from a file or a request; `origin` names their source.

        Raises:
            InvalidRig: A value is not allowed; the message names field, value and allowed values.
        """
        try:
            return cls.model_validate(fields)
        except ValidationError as error:
            reasons = []
            for fault in error.errors(include_url=False):
                field = ".".join(map(str, fault["loc"]))
                value = fault["input"]
                found = "" if isinstance(value, dict) else f" (found {value!r})"
                where = f"{field}: " if field else ""
                said = f"{where}{fault['msg'].removeprefix('Value error, ')}{found}"
                reasons.append(said + _meant(field, value))
            raise InvalidRig(_unusable(origin, "; ".join(reasons))) from error


def _unusable(origin: str, reasons: str) -> str:
    """Format the reasons as sentences; the last one may be a question."""
    return f"{origin} cannot be used. {reasons}{'' if reasons.endswith('?') else '.'}"


_OTHER_UNITS: dict[str, tuple[tuple[str, float, float, float], ...]] = {
    "height_mm": (("metres", 1000.0, 0.03, 10.0), ("centimetres", 10.0, 3.0, 5.0)),
    "diameter_mm": (
        ("metres", 1000.0, 0.1, 4.0),
        ("inches", 25.4, 4.0, 50.0),
        ("centimetres", 10.0, 10.0, 50.0),
    ),
    "segment_length_mm": (("metres", 1000.0, 0.5, 20.0), ("centimetres", 10.0, 50.0, 100.0)),
}
"""Other units of a length that is too small in mm: name, mm per unit, least and largest value."""


def _meant(field: str, value: object) -> str:
    """Suggest what was meant by a length that is too small; empty if unknown."""
    name = field.rpartition(".")[2]
    if not isinstance(value, int | float):
        return ""
    readings = [
        f"{value * mm:g} if it is in {unit}"
        for unit, mm, low, high in _OTHER_UNITS.get(name, ())
        if low <= value <= high
    ]
    return f"; write {', '.join(readings)}" if readings else ""


Pixels = Annotated[int, Field(ge=32, le=8192)]


_LONGEST_SIDE = {"pinhole": 7.5, "fisheye": 12.5}
"""Longest side of a picture in focal lengths: a view of 150 degrees for a pinhole, and a picture of
which a fisheye fills half the width."""

FURTHEST_CENTRE = 2.0
"""Largest distance of the principal point outside a cropped picture, in picture sizes."""

LEAST_HEIGHT_MM = 5.0
"""Least height of a camera above the wall."""


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

    def __hash__(self) -> int:
        fields = self.__dict__ | {"distortion": tuple(self.distortion)}
        return hash(tuple(fields.values()))

    def require_possible(self) -> None:
        """Check that a lens can have these focal lengths and this principal point.

        Raises:
            InvalidRig: A value is impossible; the message names field, value and probable meaning.
        """
        sides = (("fx", self.fx, "width", self.width), ("fy", self.fy, "height", self.height))
        for name, focal_px, side, pixels in sides:
            least_px = pixels / _LONGEST_SIDE[self.model]
            if focal_px < least_px:
                half_rad = pixels / 2 / focal_px
                view_rad = 2 * (half_rad if self.model == "fisheye" else np.arctan(half_rad))
                raise InvalidRig(
                    f"camera.{name}: {focal_px:g} px with {pixels} px of {side} is an angle of "
                    f"view of {np.degrees(view_rad):.0f} degrees; a {self.model} lens has at least "
                    f"{least_px:.0f} px. Is it the lens's focal length in mm? Then {name} is "
                    f"{focal_px:g} mm / (sensor's {side} in mm) x {pixels} px"
                )
        for name, centre_px, side, pixels in (
            ("cx", self.cx, "width", self.width),
            ("cy", self.cy, "height", self.height),
        ):
            if not -FURTHEST_CENTRE * pixels <= centre_px <= (1 + FURTHEST_CENTRE) * pixels:
                raise InvalidRig(
                    f"camera.{name}: {centre_px:g} px is far outside a picture of {pixels} px of "
                    f"{side}. Is it of a larger picture, or in another unit? In most cameras it is "
                    f"about {(pixels - 1) / 2:g}"
                )

    @property
    def focal_px(self) -> float:
        """Geometric mean of the two focal lengths."""
        return float(np.sqrt(self.fx * self.fy))

    @property
    def matrix(self) -> Matrix:
        """K, (3, 3), with the skew."""
        return np.array([[self.fx, self.skew, self.cx], [0, self.fy, self.cy], [0, 0, 1]])


class Mount(_Part):
    """Position and orientation of the camera on the robot, whose x is forward, y right, z down."""

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

    def require_possible(self) -> None:
        """Check that a camera can sit at this height.

        Raises:
            InvalidRig: It is nearer to the wall than any lens; the message suggests another unit.
        """
        if self.height_mm < LEAST_HEIGHT_MM:
            raise InvalidRig(
                f"mount.height_mm: {self.height_mm:g} mm is nearer to the wall than a camera can "
                f"be ({LEAST_HEIGHT_MM:g} mm or more)" + _meant("height_mm", self.height_mm)
            )


class Corrugation(_Part):
    """The waves of a corrugated metal pipe, which follow each other along it."""

    pitch_mm: float = Field(ge=5, le=1000, description="Distance from crest to crest in mm.")
    depth_mm: float = Field(ge=0.5, le=300, description="From crest to valley in mm.")


class Pipe(_Part):
    """The wall that the camera looks at."""

    shape: Literal["circular", "flat"] = Field(description="circular pipe, or flat floor.")
    diameter_mm: float | None = Field(
        None,
        ge=50,
        le=20_000,
        description="Inner diameter in mm, at the crests of a corrugated pipe; circular only, "
        "there required.",
    )
    segment_length_mm: float | None = Field(
        None, ge=100, le=20_000, description="Length of one pipe segment, joint to joint, in mm."
    )
    corrugation: Corrugation | None = Field(
        None, description="Pitch and depth of a corrugated metal pipe; circular only."
    )

    @property
    def radius_mm(self) -> float | None:
        """Radius of the wall, midway between crests and valleys of a corrugated pipe; None for a
        floor.

        Motion in the picture goes with the inverse of the distance; its mean over a wave from
        radius a to b is that at sqrt(a b), the integral of 1 / (m + d cos t) over a turn being
        2 pi / sqrt(m^2 - d^2).
        """
        if self.diameter_mm is None:
            return None
        crest_mm = self.diameter_mm / 2
        depth_mm = 0.0 if self.corrugation is None else self.corrugation.depth_mm
        return math.sqrt(crest_mm * (crest_mm + depth_mm))

    @model_validator(mode="after")
    def _diameter_goes_with_circular(self) -> Self:
        if self.shape == "circular" and self.diameter_mm is None:
            raise ValueError("diameter_mm is missing; a circular pipe needs it (50 to 20000 mm)")
        if self.shape == "flat" and self.diameter_mm is not None:
            raise ValueError("diameter_mm is given for a flat floor; leave it out")
        if self.shape == "flat" and self.corrugation is not None:
            raise ValueError("corrugation is given for a flat floor; leave it out")
        return self


class Tolerance(_Part):
    """Standard uncertainty (68 %) of each value of the rig.

    The defaults are those of a tape and a data sheet.
    """

    height_mm: float = Field(
        2.0, ge=0, le=1000, description="Uncertainty of the camera's height in mm."
    )
    tilt_deg: float = Field(
        1.0,
        ge=0,
        le=30,
        description="Uncertainty of the mount's pitch, and of its roll, in degrees.",
    )
    focal_percent: float = Field(
        0.5, ge=0, le=20, description="Uncertainty of the focal length in percent."
    )
    diameter_mm: float = Field(
        3.0, ge=0, le=1000, description="Uncertainty of the pipe's diameter in mm."
    )
    segment_length_mm: float = Field(
        5.0,
        ge=0,
        le=1000,
        description="Uncertainty of the length of a pipe segment in mm, common to all segments.",
    )


class Rig(_Part):
    """Camera, mount and pipe, which convert pixels to millimetres, and their tolerances."""

    camera: Camera
    mount: Mount
    pipe: Pipe
    tolerance: Tolerance = Tolerance.model_construct()

    @property
    def looks_along_pipe(self) -> bool:
        """Whether the camera looks along a round pipe, of which it sees a whole ring."""
        return self.mount.view == "forward" and self.pipe.shape == "circular"

    @model_validator(mode="after")
    def _camera_is_inside_the_pipe(self) -> Self:
        if self.pipe.diameter_mm is not None:
            radius_mm = self.pipe.diameter_mm / 2
            off_axis_mm = np.hypot(self.mount.lateral_mm, radius_mm - self.mount.height_mm)
            if off_axis_mm >= radius_mm:
                raise ValueError(
                    f"mount.height_mm: {self.mount.height_mm:g} mm with a lateral_mm of "
                    f"{self.mount.lateral_mm:g} puts the camera outside the pipe of "
                    f"{self.pipe.diameter_mm:g} mm diameter. Is it the height above the invert, "
                    "and diameter_mm not the radius or in another unit?"
                )
        return self

    @classmethod
    def parse(cls, fields: object, *, origin: str = "the rig") -> Self:
        """Validate a rig from a file or a request, including values that are physically impossible.

        Stored rigs are read without this check.

        Raises:
            InvalidRig: A value is not allowed or impossible; the message names it.
        """
        rig = super().parse(fields, origin=origin)
        try:
            rig.camera.require_possible()
            rig.mount.require_possible()
        except InvalidRig as error:
            raise InvalidRig(_unusable(origin, str(error))) from error
        return rig

    @classmethod
    def load(cls, path: Path | str) -> Rig:
        """Read a rig file.

        Raises:
            InvalidRig: No such file, not JSON, or a value is not allowed; the message names each.
        """
        path = Path(path)
        try:
            return cls.parse(json.loads(path.read_bytes()), origin=path.name)
        except OSError as error:
            raise InvalidRig(f"{path.name} cannot be read: {error.strerror or error}.") from error
        except (ValueError, RecursionError) as error:
            raise InvalidRig(f"{path.name} is not a JSON file: {error}.") from error

    def known_to(self, **tolerance: float) -> Rig:
        """Replace fields of the rig's `tolerance`."""
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
