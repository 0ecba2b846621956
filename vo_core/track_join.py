"""Joins the tracks of the parts of one film, each tracked by itself, into the track of the film.

Each part begins some time before its own frames, because a track learns during its first metres:
the tilt of the mount, the sway, what is fixed in the picture. So two consecutive parts have frames
in common, and there they measure the same poses. The later track is moved to the earlier one by
all well-tracked common frames, and takes over at one of them, the seam.

Beside its distance a pose needs no fitting: every track estimates where the camera stands in the
pipe, and where it stood at its first frame. Only the roll of a camera that looks along the pipe
shows nothing but its changes, and is fitted like the distance.

Uncertainty. The random part of the distance adds up as variance, from seam to seam, and the scatter
of the fit is added to it. What keeps its sign along the way adds up as length: the systematic error
of registration, and beds. The tolerances of the rig are common to all parts, so they multiply the
whole distance, as in the track of a single run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from vo_core.errors import UndeterminedSeam
from vo_core.geometry.height import scale_sigma
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.geometry.rectify import Rectifier
from vo_core.geometry.tilt import MountTilt
from vo_core.odometry import Traits
from vo_core.rig import Rig
from vo_core.state import tilt_sigma_rad
from vo_core.track import Track
from vo_core.types import Matrix

WARM_UP = 10.0
"""Way that a track needs to learn, in heights of the camera above the invert.

On rendered runs of 9 m over ten rigs and walls the distances of joined and serial track differ by
at most 0.45 of their sigma after it, and the sigmas at the end by 4 %, on silt by 5 %.  After half
of it they differ by 0.6 and 5 %, on silt by 1.2 and 13 %."""

STEP = 0.05
"""Way from one frame that ties two tracks to the next, in the same heights.

Frames of a standstill repeat one error and count once."""

MOST_TIES = 40
"""Most frames that tie two tracks."""

LEAST_TIES = 10
"""Least number of them: fewer do not show their scatter."""

OUTLIER = 4.0
"""A difference of the two tracks farther from the median than this many robust deviations."""

WORST = 0.3
"""Largest scatter of a seam, in sigmas of the registration there: they grow by 4.4 % at most."""

NEGLIGIBLE_MM = 0.05
"""Scatter of a seam that is always small enough."""

_TRAITS = fields(Traits)


@dataclass(frozen=True)
class Part:
    """What the track of some consecutive frames of a film gives to the track of all of them."""

    track: Track
    """Relative to its first frame; numbers and times are those of the film."""
    systematic_mm: Matrix
    """(N,) `Odometry.systematic_mm` at each frame."""
    bed_mm: Matrix
    """(N,) `Odometry.bed_mm` at each frame."""
    pictures: NDArray[np.int64]
    """(N,) checksum of each picture that another part may show, else 0."""
    traits: NDArray[np.bool_]
    """(N, 2) fields of `Odometry.traits` at each frame."""
    start: InitialPose = AS_STATED
    """`Odometry.start` after the last frame."""


@dataclass(frozen=True)
class Seam:
    """How a later part is moved to the part before it."""

    frame: int
    """First frame whose pose comes from the later part."""
    x_mm: float
    """Added to distances of the later part."""
    initial_pose: InitialPose
    """Added to the rest of its poses."""
    sigma_mm: float
    """Standard deviation of `x_mm`: the scatter of the frames that show it."""


@dataclass(frozen=True)
class JoinedTrack:
    """The track of a film, and where its parts meet."""

    track: Track
    seams: tuple[Seam, ...]
    """One between two consecutive parts; each is relative to the first part."""


def join_tracks(parts: Sequence[Part], rig: Rig) -> JoinedTrack:
    """Join the tracks of consecutive parts of a film, in their order.

    Returns:
        The track that one run over the whole film would give, within its stated uncertainty. Up to
        the first seam it is the track of the first part, unchanged.
    Raises:
        UndeterminedSeam: Two parts have too few well-tracked frames in common after the later one
            has learnt enough, these frames contradict each other, their pictures differ, or the
            camera looks around in the later part after the frames in common.  The
            earlier part must then be tracked further.  Or the earlier part has seen traits of the
            film that the later one must be told of.
    """
    whole, seams = parts[0], []
    for number, part in enumerate(parts[1:]):
        seam = find_seam(whole, part, rig, number)
        whole = _continued(whole, part, seam, rig)
        seams.append(seam)
    return JoinedTrack(whole.track, tuple(seams))


def find_seam(before: Part, after: Part, rig: Rig, number: int = 0) -> Seam:
    """Find where the later of two parts takes over, and how it is moved.

    Args:
        before, after: Consecutive parts.
        rig: Camera, mount and pipe.
        number: Number of the earlier part, for the error.
    Raises:
        UndeterminedSeam: See `join_tracks`.
    """
    first, count = _common(before, after, number)
    one, other = _cut(before.track, slice(first, first + count)), _cut(after.track, slice(count))
    ties = _ties(one, other, rig)
    # While a camera looks around, a track may lose its place where the same frames do not lose it
    # after another beginning (by 0.6 m on one of two rendered films). So the later part gives none
    # of these frames.
    around = np.flatnonzero(after.track.looking_around)
    ties = ties[ties > around[-1]] if around.size else ties
    if len(ties) < LEAST_TIES:
        raise UndeterminedSeam(
            f"Parts {number} and {number + 1} of the film share only {len(ties)} well-tracked "
            f"frames that tie them; {LEAST_TIES} are needed.",
            number,
        )
    x_mm, sigma_mm = _robust_mean((one.distance_mm - other.distance_mm)[ties])
    known_mm = float(np.sqrt(_random_mm2(before)[first + ties[-1]]))
    if sigma_mm > max(WORST * known_mm, NEGLIGIBLE_MM):
        raise UndeterminedSeam(
            f"Parts {number} and {number + 1} of the film differ by {sigma_mm:.2f} mm from frame "
            "to frame, too much against the uncertainty of the track.",
            number,
        )
    last = count - 1
    _compare_traits(before.traits[first + last], after.traits[last], number)
    initial_pose = _difference(after.start, before.start)
    if rig.looks_along_pipe:
        roll_deg, _ = _robust_mean((one.roll_deg - other.roll_deg)[ties])
        initial_pose = replace(initial_pose, roll_deg=roll_deg)
    return Seam(int(one.frame[ties[-1]]) + 1, x_mm, initial_pose, sigma_mm)


def join_tilts(tilts: Sequence[MountTilt], shares: Sequence[float], rig: Rig) -> MountTilt:
    """Combine what the parts of a film show of the tilt of its mount.

    Each part starts from the rig's statement, a tilt of 0, and adds its own pictures to it.  So the
    statement counts once: 1 / s^2 = 1 / s_0^2 + sum of c_k (1 / s_k^2 - 1 / s_0^2).

    Args:
        tilts: One for each part.
        shares: c_k, the shares of the frames that each part contributes; others count elsewhere.
        rig: Camera, mount and pipe.
    """
    stated = 1 / np.degrees(tilt_sigma_rad(rig)) ** 2
    mean = np.array([[tilt.pitch_deg, tilt.roll_deg] for tilt in tilts])
    sigma = np.array([[tilt.pitch_sigma_deg, tilt.roll_sigma_deg] for tilt in tilts])
    counted = np.array(shares)[:, None]
    whole = stated + (counted * np.maximum(1 / np.square(sigma) - stated, 0.0)).sum(0)
    pitch, roll = ((counted * mean / np.square(sigma)).sum(0) / whole).tolist()
    pitch_sigma, roll_sigma = (1 / np.sqrt(whole)).tolist()
    return MountTilt(pitch, roll, pitch_sigma, roll_sigma)


def _common(before: Part, after: Part, number: int) -> tuple[int, int]:
    """Row of the earlier part at which the later one begins, and the number of common frames."""
    frames = before.track.frame
    first = int(np.searchsorted(frames, after.track.frame[0])) if len(after.track) else len(frames)
    count = min(len(frames) - first, len(after.track))
    one, other = slice(first, first + count), slice(count)
    checked = (before.pictures[one] > 0) & (after.pictures[other] > 0)
    is_same = (
        np.array_equal(frames[one], after.track.frame[other])
        and np.allclose(before.track.time_s[one], after.track.time_s[other], rtol=0, atol=1e-6)
        and np.array_equal(before.pictures[one][checked], after.pictures[other][checked])
    )
    if not is_same:
        raise UndeterminedSeam(
            f"Parts {number} and {number + 1} of the film show different pictures for the same "
            "frames.",
            number,
        )
    return first, count


def _compare_traits(before: NDArray[np.bool_], after: NDArray[np.bool_], number: int) -> None:
    """Check that two parts have seen the same traits of the film, (2,) each."""
    lacks = [each.name for each, lacking in zip(_TRAITS, before & ~after, strict=True) if lacking]
    if (before != after).any():
        raise UndeterminedSeam(
            f"Parts {number} and {number + 1} of the film do not agree whether it is coarsely "
            "coded, or whether a standstill shows as equal pictures.",
            number,
            lacks,
        )


def _ties(one: Track, other: Track, rig: Rig) -> NDArray[np.intp]:
    """Rows of the common frames that tie two tracks, in order; the last of them is the seam.

    Both tracks are well-determined there, the later one has learnt enough, the rows lie apart from
    each other, and half a view of wall follows, so that joints in view at the seam are seen whole.
    """
    if not len(one):
        return np.zeros(0, np.intp)
    height_mm, grid = rig.mount.height_mm, Rectifier(rig).grid
    driven_mm = np.cumsum(np.abs(np.diff(other.distance_mm, prepend=other.distance_mm[0])))
    to_come_mm = np.abs(one.distance_mm - one.distance_mm[-1])
    good = (one.status == "ok") & (other.status == "ok")
    good &= (one.looking_around == 0) & (other.looking_around == 0)
    good &= driven_mm >= WARM_UP * height_mm
    good &= to_come_mm >= grid.shape[1] * grid.mm_per_px / 2
    rows = np.flatnonzero(good)
    place = np.floor(driven_mm[rows] / (STEP * height_mm))
    is_last = np.diff(place, append=np.inf) > 0
    return rows[is_last][-MOST_TIES:]


def _robust_mean(values: Matrix) -> tuple[float, float]:
    """Mean without outliers, and the standard deviation of one value.

    It is not divided by the number of values: two tracks drift apart slowly, so that neighbouring
    frames have nearly the same error.
    """
    off = np.abs(values - np.median(values))
    kept = values[off <= OUTLIER * max(1.4826 * float(np.median(off)), 1e-9)]
    return float(kept.mean()), float(kept.std())


def _random_mm2(part: Part) -> Matrix:
    """(N,) variance of the distance by random errors that stay in all later frames.

    Where the variance falls again, the excess has not stayed, see `Drift`.
    """
    variance = np.square(part.track.sigma_registration_mm) - np.square(part.systematic_mm)
    return np.asarray(np.minimum.accumulate(np.maximum(variance, 0.0)[::-1])[::-1])


def _continued(whole: Part, part: Part, seam: Seam, rig: Rig) -> Part:
    """Continue a part by a later one from their seam on."""
    last, row = (int(np.searchsorted(p.track.frame, seam.frame - 1)) for p in (whole, part))
    later = slice(row + 1, None)
    track = part.track
    systematic_mm = whole.systematic_mm[last] + part.systematic_mm[later] - part.systematic_mm[row]
    bed_mm = whole.bed_mm[last] + part.bed_mm[later] - part.bed_mm[row]
    variance = np.square(track.sigma_registration_mm) - np.square(part.systematic_mm)
    random_mm2 = _random_mm2(whole)[last] + seam.sigma_mm**2
    random_mm2 = random_mm2 + np.maximum(variance - _random_mm2(part)[row], 0.0)[later]
    registration_mm = np.sqrt(random_mm2 + np.square(systematic_mm))
    moved = seam.initial_pose.added_to(_cut(track, later))
    distance_mm = moved.distance_mm + seam.x_mm
    scale_mm = np.hypot(scale_sigma(rig) * distance_mm, bed_mm)
    moved = replace(
        moved,
        x_mm=moved.x_mm + seam.x_mm,
        distance_mm=distance_mm,
        sigma_registration_mm=registration_mm,
        sigma_distance_mm=np.hypot(registration_mm, scale_mm),
    )
    own = slice(last + 1)
    return Part(
        _appended(_cut(whole.track, own), moved),
        np.concatenate([whole.systematic_mm[own], systematic_mm]),
        np.concatenate([whole.bed_mm[own], bed_mm]),
        np.concatenate([whole.pictures[own], part.pictures[later]]),
        np.concatenate([whole.traits[own], part.traits[later]]),
        whole.start,
    )


def _cut(track: Track, rows: slice) -> Track:
    return Track(**{each.name: getattr(track, each.name)[rows] for each in fields(Track)})


def _appended(one: Track, other: Track) -> Track:
    names = [each.name for each in fields(Track)]
    return Track(**{n: np.concatenate([getattr(one, n), getattr(other, n)]) for n in names})


def _difference(one: InitialPose, other: InitialPose) -> InitialPose:
    return InitialPose(
        *(getattr(one, each.name) - getattr(other, each.name) for each in fields(InitialPose))
    )
