"""A finished track brought to scale by known lengths and joints: what `chainage correct` does."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vo_core import Rig, Track, joints
from vo_core.errors import InvalidCorrection, InvalidTrack
from vo_core.height import Height, implied_height, scale_sigma
from vo_core.scale import (
    TAPE_SIGMA_MM,
    Correction,
    Evidence,
    KnownLength,
    StatedScale,
    correct,
    joint_spacing,
)

_LENGTH = re.compile(
    r"(?P<first>\d+):(?P<last>\d+)=(?P<metres>\d+(\.\d*)?)((±|\+-)(?P<sigma>\d+(\.\d*)?))?"
)


def parse_length(words: str) -> KnownLength:
    """FRAME:FRAME=METRES or FRAME:FRAME=METRES±MM, with +- for ± where that is easier to type.

    Raises:
        ValueError: It is something else.
    """
    found = _LENGTH.fullmatch(words.replace(" ", ""))
    if found is None:
        raise ValueError(f"{words!r} is not FRAME:FRAME=METRES or FRAME:FRAME=METRES±MM")
    sigma = found["sigma"]
    return KnownLength(
        int(found["first"]),
        int(found["last"]),
        1000 * float(found["metres"]),
        TAPE_SIGMA_MM if sigma is None else float(sigma),
    )


@dataclass(frozen=True)
class CorrectedFile:
    """A corrected track and what is to be told of it."""

    raw: Track
    correction: Correction
    metadata: dict[str, str]
    """Of the raw file, and what was corrected by what."""
    rig: Rig | None
    height: Height | None

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of every figure, for a table."""
        done = self.correction
        rows = [
            (f"by {found.evidence}", _with_sigma(found.scale, found.sigma))
            for found in done.findings
        ]
        rows.append(("scale", _with_sigma(done.scale, done.sigma)))
        if done.scatter_mm is not None:
            rows.append(("scatter of a segment", f"{done.scatter_mm:.1f} mm"))
        if self.rig is not None:
            rows.append(("camera height", self._height(self.rig)))
        before, after = self.raw.distance_mm[-1], done.track.distance_mm[-1]
        sigma_mm = done.track.sigma_distance_mm[-1]
        rows.append(
            ("last frame", f"{after / 1000:.3f} m ± {sigma_mm:.1f} mm, was {before / 1000:.3f} m")
        )
        return rows

    def _height(self, rig: Rig) -> str:
        if self.height is None:
            return "does not tell in this rig"
        return (
            f"{self.height.height_mm:.2f} ± {self.height.sigma_mm:.2f} mm, "
            f"the rig says {rig.mount.height_mm:g} mm"
        )


def correct_file(
    track: Path,
    *,
    lengths: Sequence[KnownLength] = (),
    joints_file: Path | None = None,
    rig: Rig | None = None,
    height_sigma_mm: float = 0.0,
    focal_sigma_px: float = 0.0,
) -> CorrectedFile:
    """Correct the track in a file by all that is known.

    Args:
        rig: With which the track was made; joints and what follows need it.
        height_sigma_mm, focal_sigma_px: Standard uncertainty of what the rig states.
    Raises:
        InvalidTrack: A file that cannot be read, or a track that was corrected before.
        InvalidCorrection: What is known does not go with the track.
    """
    text = track.read_text(encoding="utf-8")
    raw, metadata = Track.from_csv(text), _metadata(text)
    if "scale" in metadata:
        raise InvalidTrack(
            f"{track.name} was corrected before, to a scale of {metadata['scale']}; correct the "
            "raw track with all that is known at once."
        )
    evidence: list[Evidence] = list(lengths)
    if rig is not None and max(height_sigma_mm, focal_sigma_px) > 0:
        evidence.append(
            StatedScale(
                scale_sigma(
                    rig.known_to(
                        height_mm=height_sigma_mm,
                        focal_percent=100 * focal_sigma_px / rig.camera.focal_px,
                    )
                )
            )
        )
    if rig is not None and joints_file is not None:
        segment_mm = rig.pipe.segment_length_mm
        if segment_mm is None:
            raise InvalidCorrection(
                "The rig does not say how long a segment is; joints need pipe.segment_length_mm."
            )
        sightings = joints.from_csv(joints_file.read_text(encoding="utf-8"))
        evidence.append(joint_spacing(raw, sightings, segment_mm, evidence))
    done = correct(raw, evidence)
    height = None if rig is None else implied_height(rig, done.scale, done.sigma)
    metadata |= {"raw_track": track.name} | done.metadata()
    if height is not None:
        metadata["height_mm"] = f"{height.height_mm:.2f} ± {height.sigma_mm:.2f}"
    return CorrectedFile(raw, done, metadata, rig, height)


def _metadata(text: str) -> dict[str, str]:
    """The `# key: value` lines of a track file."""
    lines = (line[1:].partition(":") for line in text.splitlines() if line[:1] == "#")
    return {key.strip(): value.strip() for key, _, value in lines}


def _with_sigma(value: float, sigma: float) -> str:
    return f"{value:.6f} ± {sigma:.6f}"
