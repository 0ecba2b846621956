"""Makes a rig from a film of which only the pipe is known, and says how well."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from app.lab.film_rig.bundle import Bundle, cost_of, fit
from app.lab.film_rig.flow import flow_of
from app.lab.film_rig.lens import ASPECT, BEND, CENTRE, FOCAL, LensPrior, Model, Pixels
from app.lab.film_rig.refine import measured_again
from app.lab.film_rig.scale import Factor, focal_factors
from app.lab.film_rig.scene import Part, Scene
from app.lab.film_rig.tracks import Tracks, follow
from vo_core import Rig, VideoFile
from vo_core.errors import ChainageError
from vo_core.sources import squared
from vo_core.types import ByteImage, Matrix

PARTS = 8
"""Largest number of parts of a film that are looked at."""

PARTS_TO_CHOOSE = 3
"""Number of parts by which the model of the lens is chosen."""

PART_S = 1.0
"""Least length of a part."""

LEAST_FRAMES = 5
"""Least number of frames of a film."""

MOST_FRAMES = 200
"""A part ends after so many frames, as a camera may stand for minutes."""

LEAST_MOTION = 0.03
"""Least motion of the picture in a part, as a share of its width: with less the camera stands."""

LEAST_POINTS = 25
"""Least number of points that are followed through a part."""

MANY_POINTS = 100
"""A part with fewer points is left out if another has so many."""

LEAST_SHARE = 0.35
"""Least share of the observations that must agree with the wall of a pipe."""

LEAST_DRIVE = 0.1
"""Least way driven in all parts, in radii: without it nothing shows the wall's distance."""

UNSURE = 0.03
"""Relative uncertainty of the focal length from which the user is asked for a length."""

DIAMETER_SIGMA = 0.01
"""Relative standard uncertainty of a stated diameter."""

WAY_SIGMA = 0.01
"""Relative standard uncertainty of the focal length that a known way implies.

The way follows the other parameters of the lens, too: on rendered films with crooked cameras, coded
at crf 30, the focal length was off by up to 0.95 % where the length was exact."""

BETTER = 0.7
"""A fisheye lens is taken if its cost is less than this share of a pinhole lens's."""

Progress = Callable[[str, int, int | None], None]
"""Called with what is being done, steps done and in all."""


class UnusableFilm(ChainageError):
    """The film does not show what a rig follows from; the message states why and what to do."""


@dataclass(frozen=True)
class KnownPipe:
    """What is known of the pipe."""

    diameter_mm: float
    segment_mm: float | None = None
    """Distance from joint to joint."""
    length_mm: float | None = None
    """Inspected length, from the first frame to the furthest place."""


@dataclass(frozen=True)
class FilmRig:
    """A rig found in a film."""

    rig: Rig
    bundle: Bundle
    """The fit to pictures with square pixels."""
    pixels: Pixels
    pipe: KnownPipe
    factors: tuple[Factor, ...] = ()
    """What the stated lengths said of the focal length."""
    doubts: tuple[str, ...] = ()
    """Sentences on lengths that were not used, or are unlikely."""

    @property
    def sigma(self) -> Matrix:
        """(5,) standard deviations of the lens's parameters."""
        return np.asarray(np.sqrt(np.diag(self.bundle.covariance)))

    @property
    def focal_percent(self) -> float:
        """Standard uncertainty of the focal length."""
        return 100 * float(self.sigma[FOCAL])

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of every figure, for a table."""
        camera, mount, sigma = self.rig.camera, self.rig.mount, self.sigma
        tolerance, centre = self.rig.tolerance, sigma[CENTRE]
        yaw_deg, yaw_sigma_deg = self._yaw_deg()
        radius_mm = self.pipe.diameter_mm / 2
        points = sum(part.tracks.points for part in self.bundle.parts)
        return [
            ("lens", camera.model),
            ("focal length", f"{camera.fx:.1f} px ± {self.focal_percent:.1f} %"),
            ("distortion k1", f"{camera.distortion[0]:+.4f} ± {sigma[BEND]:.4f}"),
            ("principal point", f"{camera.cx:.1f} ± {centre[0]:.1f}, "
                                f"{camera.cy:.1f} ± {centre[1]:.1f} px"),
            ("fy / fx", f"{camera.fy / camera.fx:.4f} ± {sigma[ASPECT]:.4f}"),
            ("camera pitch", f"{mount.pitch_deg:+.2f}° ± {tolerance.tilt_deg:.2f} (nose up)"),
            ("camera yaw", f"{yaw_deg:+.2f}° ± {yaw_sigma_deg:.2f} (to the right)"),
            ("camera below the axis", f"{radius_mm - mount.height_mm:+.1f} mm "
                                      f"± {tolerance.height_mm:.1f}"),
            ("camera right of the axis", f"{mount.lateral_mm:+.1f} mm"),
            ("residual", f"{self.bundle.residual_px:.2f} px over {points} points of the wall in "
                         f"{len(self.bundle.parts)} parts of the film"),
            *((f"by {one.source}", f"focal length x {one.value:.4f} ± {one.sigma:.4f}")
              for one in self.factors),
        ]  # fmt: skip

    def findings(self) -> list[str]:
        """Sentences on what the film does not show."""
        found = list(self.doubts)
        if self.sigma[FOCAL] > UNSURE:
            missing = [] if self.pipe.length_mm else ["the inspected length (--length-m)"]
            missing += [] if self.pipe.segment_mm else ["the distance of the joints (--segment-mm)"]
            said = f"focal length {self.focal_percent:.0f} % uncertain, and so is every distance"
            found.append(f"{said}: state {' or '.join(missing)}" if missing else said)
        yaw_deg, _ = self._yaw_deg()
        if abs(yaw_deg) > 1.0:
            found.append(
                f"the camera looks {abs(yaw_deg):.1f}° to the {'right' if yaw_deg > 0 else 'left'} "
                "of the pipe's axis, which a rig cannot state: tracking finds it again"
            )
        return found

    def _yaw_deg(self) -> tuple[float, float]:
        """Mean yaw in the first part, with its standard uncertainty."""
        first = self.bundle.parts[0]
        poses = self.bundle.scene.poses(self.bundle.camera, first.views)
        yaw = float(np.degrees(poses[:, 2].mean()))
        return yaw, _turn_sigma_deg(self.bundle, yaw, 2)


def calibrate_film(video: Path, pipe: KnownPipe, on_progress: Progress) -> FilmRig:
    """Find lens, axis and offset in a film, jointly with the motion.

    Raises:
        UnusableFilm: The camera stands, or the film shows no texture, or no wall of a pipe.
        UnreadableVideo: The video cannot be opened or holds no picture.
    """
    with VideoFile(video) as source:
        pixels = Pixels.of(source.info)
        parts = _moving_parts(source, pixels, on_progress)
    scene, bundle = _best_lens(parts, pixels, pipe, on_progress)
    on_progress("measuring the wall again", 0, len(bundle.parts))
    again = []
    for done, part in enumerate(bundle.parts, 1):
        measured = measured_again(scene, bundle.lens, part)
        if measured.tracks.points >= LEAST_POINTS:
            again.append(measured)
        on_progress("measuring the wall again", done, len(bundle.parts))
    if not again:
        raise UnusableFilm(_NO_WALL)
    bundle = fit(scene, again, bundle.lens)
    _require_pipe(bundle)
    found = FilmRig(_rig(bundle, pixels, pipe), bundle, pixels, pipe)
    return with_lengths(found, video, pipe, on_progress)


def with_lengths(found: FilmRig, video: Path, pipe: KnownPipe, on_progress: Progress) -> FilmRig:
    """Bring a rig from a film to the scale of the lengths that are known; without one it is kept.

    Args:
        found: A rig found without lengths.
        video: Its film, which is tracked.
        pipe: The same pipe, with an inspected length or the distance of its joints.
        on_progress: Called after each frame.
    """
    if pipe.segment_mm is None and pipe.length_mm is None:
        return found
    said = focal_factors(
        video,
        _rig(found.bundle, found.pixels, pipe),
        pipe.length_mm,
        lambda done, total: on_progress("tracking the film", done, total),
    )
    bundle = _scaled(found.bundle, said.found) if said.found else found.bundle
    rig = _rig(bundle, found.pixels, pipe)
    return FilmRig(rig, bundle, found.pixels, pipe, said.found, said.doubts)


def _moving_parts(video: VideoFile, pixels: Pixels, on_progress: Progress) -> list[Tracks]:
    """Follow points through parts that are spread over the film; parts without motion are dropped.

    Raises:
        UnusableFilm: No part shows motion, or none shows texture, or the film is too short.
    """
    duration_s = video.info.duration_s or 0.0
    count = int(np.clip(duration_s // PART_S, 1, PARTS))
    length_s = duration_s / count if duration_s else np.inf
    moving: list[Tracks] = []
    frames, points = 0, 0
    for number in range(count):
        on_progress("following the wall", number, count)
        start_s = number * length_s if number else 0.0
        tracks = follow(
            (t_s, squared(image, pixels.aspect))
            for t_s, image in _frames(video, start_s, start_s + length_s)
        )
        frames += tracks.frames
        points = max(points, tracks.followed)
        if tracks.moved_px > LEAST_MOTION * pixels.square_wh[0] and tracks.points >= LEAST_POINTS:
            moving.append(tracks)
    on_progress("following the wall", count, count)
    if frames < LEAST_FRAMES:
        raise UnusableFilm(
            f"The film is too short: {frames} frames; a second of driving is needed."
        )
    if points < LEAST_POINTS:
        raise UnusableFilm(
            "The film shows too little texture: hardly a point of the wall can be followed from "
            "frame to frame. Is it out of focus or too dark?"
        )
    if not moving:
        raise UnusableFilm(
            "The camera stands in the whole film. A rig follows from the motion of the wall: the "
            "film must show some driving."
        )
    most = max(tracks.points for tracks in moving)
    return [tracks for tracks in moving if tracks.points >= min(most, MANY_POINTS)]


def _frames(video: VideoFile, start_s: float, end_s: float) -> Iterator[tuple[float, ByteImage]]:
    if start_s > 0:
        video.seek(start_s)
    count = 0
    for frame in video:
        if frame.t_s < start_s:
            continue
        if frame.t_s >= end_s or count == MOST_FRAMES:
            return
        count += 1
        yield frame.t_s, frame.image


def _best_lens(
    parts: Sequence[Tracks], pixels: Pixels, pipe: KnownPipe, on_progress: Progress
) -> tuple[Scene, Bundle]:
    """Fit each model of a lens to some parts, and the one that explains them better to all.

    Raises:
        UnusableFilm: No part shows a wall along which the camera drives.
    """
    size_wh = pixels.square_wh
    flows = [flow_of(tracks, size_wh) for tracks in parts]
    # Most lenses have a focal length of about the picture's width.
    drive = sum(size_wh[0] * float(np.ptp(flow.drive)) for flow in flows if flow is not None)
    if drive < LEAST_DRIVE / 4:
        raise UnusableFilm(_NO_WALL)

    def begun(scene: Scene) -> list[Part]:
        started = [
            scene.start(tracks, flow, scene.prior.mean)
            for tracks, flow in zip(parts, flows, strict=True)
            if flow is not None
        ]
        return [part for part in started if part.tracks.points >= LEAST_POINTS]

    models: tuple[Model, ...] = ("pinhole", "fisheye")
    scenes = [Scene(LensPrior.of(model, pixels), pipe.diameter_mm) for model in models]
    tried: list[Bundle] = []
    costs: list[float] = []
    for done, scene in enumerate(scenes):
        on_progress("fitting the lens", done, len(models) + 1)
        some = begun(scene)[:: max(len(parts) // PARTS_TO_CHOOSE, 1)]
        if not some:
            raise UnusableFilm(_NO_WALL)
        tried.append(fit(scene, some))
        costs.append(cost_of(tried[-1], sum(len(part.tracks.point) for part in some)))
    best = 1 if costs[1] < BETTER * costs[0] else 0
    on_progress("fitting the lens", len(models), len(models) + 1)
    found = fit(scenes[best], begun(scenes[best]), tried[best].lens)
    on_progress("fitting the lens", len(models) + 1, len(models) + 1)
    return scenes[best], found


_NO_WALL = (
    "The film does not show the wall of a pipe along which a camera drives: its points move in "
    "another way. Does the camera look ahead, and is it inside the pipe?"
)


def _require_pipe(bundle: Bundle) -> None:
    poses = [bundle.scene.poses(bundle.camera, part.views) for part in bundle.parts]
    drive_mm = sum(float(np.ptp(one[:, 0])) for one in poses)
    if bundle.share < LEAST_SHARE or drive_mm < LEAST_DRIVE * bundle.scene.radius_mm:
        raise UnusableFilm(_NO_WALL)


def _scaled(bundle: Bundle, factors: Sequence[Factor]) -> Bundle:
    """Fit again with the focal length that the lengths imply, as if it had been known before."""
    weights = np.array([(one.value / one.sigma) ** 2 for one in factors])
    log = np.log([one.value for one in factors])
    prior = bundle.scene.prior
    mean, sigma = prior.mean.copy(), prior.sigma.copy()
    mean[FOCAL] = bundle.lens[FOCAL] + float(weights @ log / weights.sum())
    sigma[FOCAL] = np.hypot(weights.sum() ** -0.5, WAY_SIGMA)
    scene = replace(bundle.scene, prior=replace(prior, mean=mean, sigma=sigma))
    lens = bundle.lens.copy()
    lens[FOCAL] = mean[FOCAL]
    return fit(scene, bundle.parts, lens)


def _rig(bundle: Bundle, pixels: Pixels, pipe: KnownPipe) -> Rig:
    """The rig: the camera as it sat in the first part of the film."""
    first, covariances = bundle.parts[0], bundle.view_covariances[0]
    poses = bundle.scene.poses(bundle.camera, first.views)
    mean, spread = poses.mean(axis=0), poses.std(axis=0)
    z_sigma_mm = float(np.sqrt(covariances[:, 3, 3].mean() + spread[3] ** 2))
    pitch_deg = float(np.degrees(mean[4]))
    tilt_deg = np.hypot(_turn_sigma_deg(bundle, pitch_deg, 4), np.degrees(spread[4]))
    radius_mm = pipe.diameter_mm / 2
    # A camera that the fit puts into the wall is at its edge: the tracker starts from there.
    aside = np.hypot(mean[1], mean[3]) / (0.9 * radius_mm)
    lateral_mm, below_mm = mean[[1, 3]] / max(aside, 1.0)
    camera = pixels.camera(bundle.camera).model_dump()
    camera |= {name: round(camera[name], 3) for name in ("fx", "fy", "cx", "cy")}
    camera["distortion"] = [round(value, 6) for value in camera["distortion"]]
    focal_percent = 100 * float(np.sqrt(bundle.covariance[FOCAL, FOCAL]))
    return Rig.parse(
        {
            "camera": camera,
            "mount": {
                "view": "forward",
                "height_mm": round(radius_mm - float(below_mm), 2),
                "rotation_deg": 0.0,
                "lateral_mm": round(float(lateral_mm), 2),
                "pitch_deg": round(pitch_deg, 3),
            },
            "pipe": {
                "shape": "circular",
                "diameter_mm": pipe.diameter_mm,
                "segment_length_mm": pipe.segment_mm,
            },
            "tolerance": {
                "height_mm": round(min(z_sigma_mm, 1000.0), 2),
                "tilt_deg": round(min(float(tilt_deg), 30.0), 3),
                "focal_percent": round(min(focal_percent, 20.0), 3),
                "diameter_mm": round(DIAMETER_SIGMA * pipe.diameter_mm, 2),
            },
        },
        origin="the rig of the film",
    )


def _turn_sigma_deg(bundle: Bundle, turn_deg: float, column: int) -> float:
    """Standard uncertainty of yaw (column 2) or pitch (4) in the first part.

    tan(turn) is the way from the principal point to the vanishing point over the focal length.
    """
    sigma = np.sqrt(np.diag(bundle.covariance))
    centre_px = float(sigma[CENTRE][column // 2 - 1])
    point_px = float(np.sqrt(bundle.view_covariances[0][:, column, column].mean()))
    slope = np.hypot(np.hypot(centre_px, point_px) / bundle.camera.fx,
                     np.tan(np.radians(turn_deg)) * sigma[FOCAL])  # fmt: skip
    return float(np.degrees(slope))
