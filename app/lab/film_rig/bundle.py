"""Bundle adjustment on the wall of a known pipe: lens, views and wall points from tracks.

Unknown are the lens (5), the view of each keyframe (6) and the place of each point on the wall (2).
A point on a cylinder has one unknown less than one in space, so each observation after the first
adds two equations for a view; the radius gives the scale.  Points couple only to the keyframes of
their own part of the film, and are eliminated (Schur complement), and so are the views of each
part; what is left of it is a system of five equations for the lens.

Residuals are weighted as if they followed a Cauchy distribution.  Where points and model disagree
together (a wall that is not round, a lens that breathes), single residuals are no measure of the
error.  So each part is also asked alone for its lens: parts that disagree by more than their own
uncertainty inflate the common one (Birge 1932).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.lab.film_rig.lens import LENS
from app.lab.film_rig.scene import FURTHEST, VIEW, Part, Scene
from app.lab.film_rig.tracks import Tracks
from vo_core.rig import Camera
from vo_core.types import Matrix

OFF_AXIS = 0.3
"""Standard deviation of a camera's distance from the axis, to the right and down, in radii."""

TURN = 0.5
"""Standard deviation of the vanishing point from the middle, in widths of the picture."""

ROLL_RAD = 0.2
"""Standard deviation of the roll against the first keyframe of a part."""

STEPS = 40
"""Largest number of steps of a fit."""

ENOUGH = 1e-2
"""A fit ends when a nearly undamped step lowers the cost by less, in units of chi squared, ..."""

SMALL_DAMPING = 1e-4
"""... that is with damping up to this."""

MOST_DAMPING = 1e6

ROUNDS = 4
"""Fits with the outliers of the one before left out."""

START_RESIDUAL = 0.003
"""Standard deviation of an observation in the first fit, as a share of the picture's width."""

LEAST_RESIDUAL_PX = 0.05
"""Least standard deviation of an observation: corners are not found more exactly."""

OUTLIER = 6.0
"""An observation this many standard deviations off shows no wall, and is left out."""

LEAST_INFLATION = 16.0
"""Least factor on the variances: errors of neighbours, and of a point in many keyframes, are alike.

On rendered films, coded well (crf 18) and poorly (crf 30), straight, wandering and tilted, the
focal length was within two of the standard deviations that follow from this."""

_C2 = 2.385**2
"""Square of the width of the Cauchy distribution, which is 95 % efficient for normal errors."""


@dataclass(frozen=True)
class Bundle:
    """The fit of all parts."""

    scene: Scene
    lens: Matrix
    """(5,)"""
    covariance: Matrix
    """(5, 5) of the lens, inflated."""
    parts: tuple[Part, ...]
    residual_px: float
    """Standard deviation of an observation, per coordinate."""
    share: float
    """Share of the observations that agree with the wall of a pipe."""
    inflation: float
    """Factor on the variances by the disagreement of the parts."""
    view_covariances: tuple[Matrix, ...]
    """(K, 6, 6) of the views of each part, that of the lens included."""

    @property
    def camera(self) -> Camera:
        """The camera found."""
        return self.scene.prior.camera(self.lens)


def fit(scene: Scene, parts: Sequence[Part], lens: Matrix | None = None) -> Bundle:
    """Fit lens, views and points; outliers are left out on the way.

    Args:
        scene: Kind of lens and pipe.
        parts: Observations, with views and places to start from.
        lens: Lens to start from; a usual one if there is none.
    """
    prior = scene.prior
    lens = prior.mean.copy() if lens is None else lens
    total = sum(len(part.tracks.point) for part in parts)
    sigma_px = START_RESIDUAL * prior.size_wh[0]
    inflation = LEAST_INFLATION
    for _ in range(ROUNDS):
        lens, parts, reduced = _solve(_firmer(scene, inflation), lens, parts, sigma_px)
        inflation = _birge(scene, lens, reduced)
        off_px = [_lengths(scene, lens, part) for part in parts]
        # The median of a Rayleigh distribution is 1.177 sigma.
        sigma_px = max(float(np.median(np.concatenate(off_px))) / 1.177, LEAST_RESIDUAL_PX)
        parts = [
            part.only(off < OUTLIER * sigma_px) for part, off in zip(parts, off_px, strict=True)
        ]
    lens, parts, reduced = _solve(_firmer(scene, inflation), lens, parts, sigma_px)
    inflation = max(inflation, _birge(scene, lens, reduced))
    data = sum((one.normal for one in reduced), np.zeros((LENS, LENS))) / inflation
    covariance = np.asarray(np.linalg.inv(np.diag(prior.sigma**-2.0) + data), np.float64)
    return Bundle(
        scene=scene,
        lens=lens,
        covariance=covariance,
        parts=tuple(parts),
        residual_px=sigma_px,
        share=sum(len(part.tracks.point) for part in parts) / max(total, 1),
        inflation=inflation,
        view_covariances=tuple(one.view_covariances(covariance, inflation) for one in reduced),
    )


def _solve(
    scene: Scene, lens: Matrix, parts: Sequence[Part], sigma_px: float
) -> tuple[Matrix, list[Part], list[_Reduced]]:
    """Levenberg and Marquardt; returns the reduced equations without damping, too."""
    prior, parts = scene.prior, list(parts)
    damping, cost = 1e-3, _cost(scene, lens, parts, sigma_px)
    equations = [_Equations(scene, lens, part, sigma_px) for part in parts]
    for _ in range(STEPS):
        reduced = [one.reduced(damping) for one in equations]
        normal = np.diag(prior.sigma**-2.0) + sum(one.normal for one in reduced)
        right = (prior.mean - lens) / prior.sigma**2 + sum(one.right for one in reduced)
        step = np.asarray(np.linalg.solve(normal, right), np.float64)
        moved = [one.moved(part, step) for one, part in zip(reduced, parts, strict=True)]
        new_cost = _cost(scene, lens + step, moved, sigma_px)
        gain = cost - new_cost
        if gain > 0:
            lens, parts, cost = lens + step, moved, new_cost
            equations = [_Equations(scene, lens, part, sigma_px) for part in parts]
        if (abs(gain) < ENOUGH and damping <= SMALL_DAMPING) or damping > MOST_DAMPING:
            break
        damping *= 0.1 if gain > 0 else 10
    return lens, parts, [one.reduced(0.0) for one in equations]


def _cost(scene: Scene, lens: Matrix, parts: Sequence[Part], sigma_px: float) -> float:
    """Minus twice the logarithm of the likelihood, apart from a constant."""
    total = float((((lens - scene.prior.mean) / scene.prior.sigma) ** 2).sum())
    for part in parts:
        off = _lengths(scene, lens, part) / sigma_px
        total += float(_C2 * np.log1p(np.minimum(off, 1e3) ** 2 / _C2).sum())
        mean, sigma = _usual_views(scene, part)
        total += float((((part.views - mean) / sigma) ** 2).sum())
    return total


def _lengths(scene: Scene, lens: Matrix, part: Part) -> Matrix:
    """(N,) px from where the points are seen to where they should be; inf behind the camera."""
    off = np.linalg.norm(part.tracks.uv_px - scene.pixels(lens, part), axis=1)
    return np.asarray(np.nan_to_num(off, nan=np.inf))


def _usual_views(scene: Scene, part: Part) -> tuple[Matrix, Matrix]:
    """(K, 6) means and standard deviations of the views, before the film is looked at.

    The first keyframe fixes where way and roll count from.
    """
    width, height = scene.prior.size_wh
    aside_mm = OFF_AXIS * scene.radius_mm
    mean = np.tile([0.0, 0.0, width / 2, 0.0, height / 2, 0.0], (len(part.views), 1))
    sigma = np.tile(
        [np.inf, aside_mm, TURN * width, aside_mm, TURN * width, ROLL_RAD], (len(part.views), 1)
    )
    sigma[0, [0, 5]] = 1e-5 * scene.radius_mm / width, 1e-5
    return mean, sigma


class _Equations:
    """The normal equations of one part: lens and views, coupled with its points."""

    def __init__(self, scene: Scene, lens: Matrix, part: Part, sigma_px: float) -> None:
        tracks = part.tracks
        count = len(part.views)
        width = LENS + VIEW * count
        residual, by_lens, by_view, by_place = _linearised(scene, lens, part)
        off = np.nan_to_num(np.linalg.norm(residual, axis=1) / sigma_px, nan=np.inf)
        root = np.sqrt(1 / (1 + off**2 / _C2))[:, None] / sigma_px
        residual = np.nan_to_num(residual) * root
        rows = np.zeros((len(off), 2, width))
        rows[..., :LENS] = by_lens
        at = LENS + VIEW * tracks.keyframe[:, None] + np.arange(VIEW)
        np.put_along_axis(rows, np.repeat(at[:, None], 2, 1), by_view, 2)
        rows = np.nan_to_num(rows) * root[..., None]
        by_place = np.nan_to_num(by_place) * root[..., None]
        flat = rows.reshape(-1, width)
        self._normal, self._right = flat.T @ flat, flat.T @ residual.ravel()
        transposed = by_place.swapaxes(1, 2)
        self._blocks = _by_point(tracks, transposed @ by_place)
        self._place_right = _by_point(tracks, (transposed @ residual[..., None])[..., 0])
        self._across = _by_point(tracks, transposed @ rows)
        mean, sigma = _usual_views(scene, part)
        views = np.arange(LENS, width)
        self._normal[views, views] += (sigma**-2.0).ravel()
        self._right[views] += ((mean - part.views) / sigma**2).ravel()
        reach = np.array([FURTHEST * scene.radius_mm / scene.prior.size_wh[0], scene.radius_mm])
        self._blocks += np.diag((1e3 * reach) ** -2.0)  # a point that nobody sees stays

    def reduced(self, damping: float) -> _Reduced:
        """Eliminate points and views."""
        width = len(self._right)
        blocks = self._blocks.copy()
        blocks[:, [0, 1], [0, 1]] *= 1 + damping
        inverse = np.asarray(np.linalg.inv(blocks), np.float64)
        solved = (inverse @ self._across).reshape(-1, width)
        normal = self._normal - self._across.reshape(-1, width).T @ solved
        right = self._right - solved.T @ self._place_right.ravel()
        # The damping is that of the equations before the elimination (Marquardt).
        normal[np.diag_indices(width)] += damping * np.diag(self._normal)
        views = slice(LENS, None)
        covariance = np.asarray(np.linalg.inv(normal[views, views]), np.float64)
        coupling = normal[:LENS, views]
        return _Reduced(
            normal=normal[:LENS, :LENS] - coupling @ covariance @ coupling.T,
            right=right[:LENS] - coupling @ covariance @ right[views],
            view_covariance=covariance,
            view_right=right[views],
            coupling=coupling,
            places=(inverse, self._place_right, self._across),
        )


@dataclass(frozen=True)
class _Reduced:
    """The equations of one part for the lens alone, and what its other unknowns follow from."""

    normal: Matrix
    right: Matrix
    view_covariance: Matrix
    view_right: Matrix
    coupling: Matrix
    places: tuple[Matrix, Matrix, Matrix]

    def moved(self, part: Part, lens_step: Matrix) -> Part:
        """The part after a step of the lens, with the steps of its views and points."""
        views = self.view_covariance @ (self.view_right - self.coupling.T @ lens_step)
        inverse, right, across = self.places
        step = np.concatenate([lens_step, views])
        places = (inverse @ (right - across @ step)[..., None])[..., 0]
        return replace(
            part, views=part.views + views.reshape(-1, VIEW), places=part.places + places
        )

    def view_covariances(self, lens_covariance: Matrix, inflation: float) -> Matrix:
        """(K, 6, 6) covariances of the views, with that of the lens."""
        by_lens = self.view_covariance @ self.coupling.T
        whole = inflation * self.view_covariance + by_lens @ lens_covariance @ by_lens.T
        count = len(whole) // VIEW
        blocks = whole.reshape(count, VIEW, count, VIEW)
        return np.asarray(blocks[np.arange(count), :, np.arange(count)])


def _linearised(scene: Scene, lens: Matrix, part: Part) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Residuals (N, 2), and slopes by lens (N, 2, 5), views (N, 2, 6) and places (N, 2, 2)."""
    views, places = part.views[part.tracks.keyframe], part.places[part.tracks.point]
    here = scene.seen(lens, views, places)
    radius_mm, width = scene.radius_mm, scene.prior.size_wh[0]
    way = 1e-5 * radius_mm / width
    lens_steps = np.array([1e-6, 1e-6, 1e-3, 1e-3, 1e-6])
    view_steps = np.array([way, 1e-5 * radius_mm, 1e-3, 1e-5 * radius_mm, 1e-3, 1e-6])
    place_steps = np.array([way, 1e-5 * radius_mm])

    def slopes(see: Callable[[Matrix], Matrix], at: Matrix, steps: Matrix) -> Matrix:
        columns = []
        for axis, step in enumerate(steps):
            there = at.copy()
            there[..., axis] += step
            columns.append((see(there) - here) / step)
        return np.stack(columns, -1)

    return (
        part.tracks.uv_px - here,
        slopes(lambda moved: scene.seen(moved, views, places), lens, lens_steps),
        slopes(lambda moved: scene.seen(lens, moved, places), views, view_steps),
        slopes(lambda moved: scene.seen(lens, views, moved), places, place_steps),
    )


def _by_point(tracks: Tracks, values: Matrix) -> Matrix:
    """(P, ...) sums of the values of the observations, (N, ...), of each point."""
    return np.asarray(np.add.reduceat(values, tracks.starts, axis=0))


def cost_of(bundle: Bundle, observations: int) -> float:
    """Mean cost of the observations before outliers were left out, for comparing models.

    An outlier costs as much as the least of what is left out.
    """
    kept = np.concatenate([_lengths(bundle.scene, bundle.lens, part) for part in bundle.parts])
    outliers = observations - len(kept)
    limit_px = OUTLIER * bundle.residual_px
    return float(((kept**2).sum() + outliers * limit_px**2) / observations)


def _firmer(scene: Scene, inflation: float) -> Scene:
    """The scene with a prior that has its weight against observations that are less sure."""
    prior = scene.prior
    return replace(scene, prior=replace(prior, sigma=prior.sigma / np.sqrt(inflation)))


def _birge(scene: Scene, lens: Matrix, reduced: Sequence[_Reduced]) -> float:
    """How much more the parts disagree about the lens than their uncertainty allows.

    What was known beforehand counts as one more part.
    """
    chi2 = float((((lens - scene.prior.mean) / scene.prior.sigma) ** 2).sum())
    freedom = 0
    for one in reduced:
        values, vectors = np.linalg.eigh(one.normal)
        known = values > 1e-9 * values.max()
        chi2 += float(((vectors[:, known].T @ one.right) ** 2 / values[known]).sum())
        freedom += int(known.sum())
    return max(chi2 / max(freedom, 1), LEAST_INFLATION)
