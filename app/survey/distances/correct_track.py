"""Brings a finished track to scale by known lengths and joints, for `chainage correct`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vo_core import Rig, Track
from vo_core.csv_rows import decoded
from vo_core.errors import InvalidCorrection, InvalidTrack
from vo_core.geometry.height import Height, implied_height
from vo_core.joints import sightings as joints
from vo_core.scale.correction import Correction, correct
from vo_core.scale.evidence import TAPE_SIGMA_MM, KnownLength, rig_scale
from vo_core.scale.proposal import ScaleProposal, propose
from vo_core.track import metadata_of

_LENGTH = re.compile(
    r"(?P<first>\d+):(?P<last>\d+)=(?P<metres>\d+(\.\d*)?)((±|\+-)(?P<sigma>\d+(\.\d*)?))?"
)


def parse_length(words: str) -> KnownLength:
    """Parse FRAME:FRAME=METRES or FRAME:FRAME=METRES±MM; +- may stand for ±.

    Raises:
        ValueError: The text has another form.
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
    """A corrected track and the figures to report about it."""

    raw: Track
    correction: Correction
    metadata: dict[str, str]
    """Header of the raw file, and what was corrected by what."""
    rig: Rig | None
    height: Height | None
    by_joints: ScaleProposal | None

    def rows(self) -> list[tuple[str, str]]:
        """Return name and value of every figure, for a table."""
        done = self.correction
        rows = [
            (f"by {found.evidence}", _with_sigma(found.scale, found.sigma))
            for found in done.findings
        ]
        rows.append(("scale", _with_sigma(done.scale, done.sigma)))
        rows += [
            (
                f"from {stretch.from_mm / 1000:.3f} to {stretch.to_mm / 1000:.3f} m",
                _with_sigma(stretch.scale, stretch.sigma),
            )
            for stretch in done.stretches
        ]
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
        if self.correction.stretches:
            return "none explains a scale that changes along the run"
        if self.height is None:
            return "hardly matters in this rig"
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
    """Correct the track of a file by all that is known.

    Args:
        rig: The rig of the track; its tolerances are evidence too, and joints need it.
        height_sigma_mm, focal_sigma_px: Replace the tolerances of the rig if above 0.
    Raises:
        InvalidTrack: The file cannot be read, or its track is already corrected.
        InvalidCorrection: What is known does not fit the track.
    """
    text = decoded(track.read_bytes())
    raw, metadata = Track.from_csv(text), metadata_of(text.splitlines())
    if "scale" in metadata:
        raise InvalidTrack(
            f"{track.name} was corrected before, to a scale of {metadata['scale']}; correct the "
            "raw track with all that is known at once."
        )
    by_joints = None
    if rig is None:
        done = correct(raw, lengths)
    else:
        rig = _with_tolerance(rig, height_sigma_mm, focal_sigma_px)
        if joints_file is not None:
            by_joints = _proposed(raw, joints_file, rig, lengths)
        done = by_joints.correction if by_joints else correct(raw, [*lengths, *rig_scale(rig)])
    height = None
    if rig is not None and not done.stretches:
        height = implied_height(rig, done.scale, done.sigma)
    metadata |= {"raw_track": track.name} | done.metadata()
    if height is not None:
        metadata["height_mm"] = f"{height.height_mm:.2f} ± {height.sigma_mm:.2f}"
    return CorrectedFile(raw, done, metadata, rig, height, by_joints)


def _with_tolerance(rig: Rig, height_sigma_mm: float, focal_sigma_px: float) -> Rig:
    stated = {
        "height_mm": height_sigma_mm,
        "focal_percent": 100 * focal_sigma_px / rig.camera.focal_px,
    }
    return rig.known_to(**{name: sigma for name, sigma in stated.items() if sigma > 0})


def _proposed(
    raw: Track, joints_file: Path, rig: Rig, lengths: Sequence[KnownLength]
) -> ScaleProposal:
    if rig.pipe.segment_length_mm is None:
        raise InvalidCorrection(
            "The rig does not say how long a segment is; joints need pipe.segment_length_mm."
        )
    sightings = joints.from_csv(decoded(joints_file.read_bytes()))
    proposal = propose(raw, sightings, rig, lengths)
    if proposal is None:
        raise InvalidCorrection(
            f"{'One joint was' if sightings else 'No joints were'} seen, at least two are needed; "
            "correct the track by a taped length instead."
        )
    return proposal


def _with_sigma(value: float, sigma: float) -> str:
    return f"{value:.6f} ± {sigma:.6f}"
