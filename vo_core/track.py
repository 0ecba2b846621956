"""The track of a run: one estimate per frame, as columns, and its file formats."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from itertools import takewhile
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vo_core.csv_rows import finite, named_rows
from vo_core.errors import InvalidTrack
from vo_core.geometry.wall import Pose

Status = Literal["ok", "weak", "lost"]
"""ok: measured; weak: measured with low confidence; lost: the motion before goes on."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Pose of the camera in one frame, relative to the first frame."""

    frame: int
    """Index in presentation order, from 0."""
    time_s: float
    """Presentation time in seconds."""
    x_mm: float
    """Axial coordinate from the zero point, falling when the robot reverses."""
    y_mm: float
    """To the right of the first frame's position."""
    yaw_deg: float
    """From x towards y: clockwise seen from above."""
    distance_mm: float
    """Chainage: the axial coordinate of the camera, signed; not the length of the path."""
    sigma_distance_mm: float
    """Standard uncertainty of `distance_mm` against the true distance, all sources included."""
    quality: float
    """0 (nothing recognised) to 1 (certain)."""
    status: Status
    sigma_registration_mm: float
    """The part by registration and bridging, without the rig's tolerances."""
    z_mm: float = 0.0
    """Below the first frame's height: down is positive."""
    pitch_deg: float = 0.0
    """Against the first frame, nose up positive."""
    roll_deg: float = 0.0
    """Against the first frame, right side down positive."""
    looking_around: float = 0.0
    """1 while the robot stands and its camera looks around, else 0."""

    @classmethod
    def of(cls, pose: Pose, **others: Any) -> Estimate:
        """The estimate of a pose against the first frame; `others` are the fields beside it."""
        return cls(
            x_mm=pose.x_mm,
            y_mm=pose.y_mm,
            yaw_deg=math.degrees(pose.yaw_rad),
            distance_mm=pose.x_mm,
            z_mm=pose.z_mm,
            pitch_deg=math.degrees(pose.pitch_rad),
            roll_deg=math.degrees(pose.roll_rad),
            **others,
        )

    @property
    def pose(self) -> Pose:
        """The pose in radians, as the geometry of the wall uses it."""
        yaw, pitch, roll = (math.radians(a) for a in (self.yaw_deg, self.pitch_deg, self.roll_deg))
        return Pose(self.distance_mm, self.y_mm, yaw, self.z_mm, pitch, roll)

    def variance_since(self, before: Estimate) -> float:
        """Variance that registration and bridging have added since an estimate, mm^2."""
        return self.sigma_registration_mm**2 - before.sigma_registration_mm**2


COLUMNS = tuple(field.name for field in fields(Estimate))
_OF_OLD = COLUMNS[: COLUMNS.index("status") + 1]
"""Columns that every track file has; older files have only these."""

_ROW = np.dtype(
    [
        (name, {"frame": np.dtype("i8"), "status": np.dtype("U5")}.get(name, np.dtype("f8")))
        for name in COLUMNS
    ]
)
"""One line of a file; a status is cut to one character more than the longest allowed one."""

_DECIMALS = {
    "time_s": 6, "x_mm": 4, "y_mm": 4, "yaw_deg": 5,
    "distance_mm": 4, "sigma_distance_mm": 4, "quality": 3,
    "sigma_registration_mm": 4, "z_mm": 4, "pitch_deg": 5, "roll_deg": 5, "looking_around": 0,
}  # fmt: skip


@dataclass(frozen=True)
class Track:
    """Estimates as columns, each (N,), in the order of the frames."""

    frame: NDArray[np.int64]
    time_s: NDArray[np.float64]
    x_mm: NDArray[np.float64]
    y_mm: NDArray[np.float64]
    yaw_deg: NDArray[np.float64]
    distance_mm: NDArray[np.float64]
    sigma_distance_mm: NDArray[np.float64]
    quality: NDArray[np.float64]
    status: NDArray[np.str_]
    sigma_registration_mm: NDArray[np.float64]
    z_mm: NDArray[np.float64]
    pitch_deg: NDArray[np.float64]
    roll_deg: NDArray[np.float64]
    looking_around: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.frame)

    @classmethod
    def from_estimates(cls, estimates: Iterable[Estimate]) -> Track:
        """Build the columns from estimates."""
        return cls._from_rows([[getattr(e, name) for name in COLUMNS] for e in estimates])

    @classmethod
    def _from_rows(cls, rows: list[list[Any]]) -> Track:
        columns = list(zip(*rows, strict=True)) if rows else [()] * len(COLUMNS)
        dtypes = {"frame": np.int64, "status": np.str_}
        return cls(
            **{
                name: np.array(column, dtypes.get(name, np.float64))
                for name, column in zip(COLUMNS, columns, strict=True)
            }
        )

    def _rows(self) -> list[list[Any]]:
        columns = [getattr(self, name).tolist() for name in COLUMNS]
        return [list(row) for row in zip(*columns, strict=True)]

    def to_csv(self, metadata: Mapping[str, object] | None = None) -> str:
        """Write track.csv: `# key: value` lines, the header, and one row per frame."""
        out = io.StringIO()
        for key, value in (metadata or {}).items():
            out.write(f"# {key}: {' '.join(str(value).split())}\n")
        out.write(CSV_HEADER)
        for row in self._rows():
            out.write(csv_row(Estimate(*row)))
        return out.getvalue()

    @classmethod
    def from_csv(cls, text: str) -> Track:
        """Read track.csv; lines that start with # are metadata.

        An older file ends with `status`; its sigma is that of the registration.

        Raises:
            InvalidTrack: A column is missing, a value is not a finite number, or the frames do
                not rise; the message names the line.
        """
        return cls._of_sound_file(text) or cls._from_lines(text)

    @classmethod
    def _of_sound_file(cls, text: str) -> Track | None:
        """Read the columns at once; None if the file is not exactly as `to_csv` writes it.

        Numpy parses the numbers of a long track in a thirtieth of the time.
        """
        lines = text.splitlines()
        begin = next((n for n, line in enumerate(lines) if line[:1] != "#"), len(lines))
        has_rows = len(lines) > begin + 1
        if not has_rows or lines[begin] != CSV_HEADER.rstrip("\n"):
            return None
        try:
            columns = np.loadtxt(lines[begin + 1 :], _ROW, comments=None, delimiter=",", ndmin=1)
        except ValueError:
            return None
        is_sound = (
            all(np.isfinite(columns[name]).all() for name in COLUMNS if name != "status")
            and np.isin(columns["status"], get_args(Status)).all()
            and (np.diff(columns["frame"], prepend=-1) > 0).all()
            and columns["frame"][-1] < 2**53
        )
        if not is_sound:
            return None
        return cls(**{name: np.ascontiguousarray(columns[name]) for name in COLUMNS})

    @classmethod
    def _from_lines(cls, text: str) -> Track:
        """Read line by line, so that what is wrong can be named."""
        _, found = named_rows(text, _OF_OLD, "track")
        rows: list[list[Any]] = []
        for number, record in found:
            try:
                values = {name: finite(record[name]) for name in _OF_OLD if name != "status"}
                further = {
                    "sigma_registration_mm": values["sigma_distance_mm"],
                    **dict.fromkeys(("z_mm", "pitch_deg", "roll_deg", "looking_around"), 0.0),
                }
                values |= {
                    name: finite(record[name]) if name in record else default
                    for name, default in further.items()
                }
            except ValueError as error:
                raise InvalidTrack(f"Line {number} of the track is not a row: {error}.") from error
            if record["status"] not in get_args(Status):
                raise InvalidTrack(
                    f"Line {number} of the track has status {record['status']!r}; "
                    "allowed are ok, weak, lost."
                )
            if not (rows[-1][0] if rows else -1) < values["frame"] < 2**53:
                raise InvalidTrack(
                    f"Line {number} of the track is out of order: frames rise from 0."
                )
            rows.append([(values | {"status": record["status"]})[name] for name in COLUMNS])
        return cls._from_rows(rows)

    def to_tum(self) -> str:
        """Write a TUM trajectory for evo: `t x y z qx qy qz qw`, metres, z down."""
        position_m = np.column_stack([self.x_mm, self.y_mm, self.z_mm]) / 1e3
        lines = (
            f"{t:.6f} {x:.7f} {y:.7f} {z:.7f} {qx:.9f} {qy:.9f} {qz:.9f} {qw:.9f}\n"
            for t, (x, y, z), (qx, qy, qz, qw) in zip(
                self.time_s, position_m, self._quaternions(), strict=True
            )
        )
        return "".join(lines)

    def _quaternions(self) -> NDArray[np.float64]:
        """(N, 4) quaternions x y z w of R_z(yaw) R_y(pitch) R_x(roll)."""
        half = [np.radians(angle) / 2 for angle in (self.yaw_deg, self.pitch_deg, self.roll_deg)]
        (cz, cy, cx), (sz, sy, sx) = np.cos(half), np.sin(half)
        return np.column_stack(
            [
                cz * cy * sx - sz * sy * cx,
                cz * sy * cx + sz * cy * sx,
                sz * cy * cx - cz * sy * sx,
                cz * cy * cx + sz * sy * sx,
            ]
        )

    def to_json(
        self,
        metadata: Mapping[str, object] | None = None,
        *,
        lengths_mm: Mapping[str, NDArray[np.float64]] | None = None,
    ) -> str:
        """Write `{"metadata": {...}, "columns": {name: [...]}}`, numbers rounded as in the CSV.

        Args:
            metadata: Metadata of the track.
            lengths_mm: Further columns in mm, each (N,).
        """
        columns = {
            name: [
                round(v, _DECIMALS[name]) if name in _DECIMALS else v
                for v in getattr(self, name).tolist()
            ]
            for name in COLUMNS
        }
        for name, further in (lengths_mm or {}).items():
            columns[name] = [round(v, 4) for v in further.tolist()]
        return json.dumps({"metadata": dict(metadata or {}), "columns": columns}, allow_nan=False)


CSV_HEADER = ",".join(COLUMNS) + "\n"


def metadata_of(lines: Iterable[str]) -> dict[str, str]:
    """Read the `# key: value` lines at the head of a track file."""
    head = takewhile(lambda line: line[:1] == "#", lines)
    parts = (line[1:].partition(":") for line in head)
    return {key.strip(): value.strip() for key, _, value in parts}


def csv_row(estimate: Estimate) -> str:
    """Format one line of track.csv, so that a file can be written during the run."""
    return (
        ",".join(
            f"{value:.{_DECIMALS[name]}f}" if name in _DECIMALS else str(value)
            for name in COLUMNS
            for value in (getattr(estimate, name),)
        )
        + "\n"
    )
