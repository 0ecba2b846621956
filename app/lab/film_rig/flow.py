"""A first guess of drive and vanishing point from the flow of the points, for any lens.

The search in one picture, by shading (`vo_core.image.axis`), is good to some degrees and has no
drive; a fit starts from what moves.

On the axis of a pipe a wall point at the axial distance x appears at the radius r = f R / x from
the vanishing point, and driving on by dx moves it outwards by dr = r^2 dx / (f R).  A camera beside
the axis sees the wall nearer on one side, and a turn shifts the whole picture.  So between two
pictures, with d the place of a point from the vanishing point,

    flow(d) = |d| d (c + e . d / |d|) + t + w J d

is linear in c (drive), e (offset, 2), t (turn, 2) and w (roll, J the quarter turn). The vanishing
point itself is found by trying places in and around the picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.lab.film_rig.tracks import Tracks
from vo_core.types import Matrix

SHARP = 0.0015
"""Residual of the flow at which a point counts half, as a share of the picture's width."""

LEAST_PAIR = 12
"""Least number of points that two keyframes share."""

_TURNS = 4
"""Rounds of weighting by the residuals."""

_GRIDS = ((1.3, 15), (0.2, 7), (0.05, 5))
"""Size of each grid of places in pictures, and its places along a side."""


@dataclass(frozen=True)
class Flow:
    """The first guess of one part."""

    vanishing_px: Matrix
    """(K, 2) where the pipe's axis vanishes in each keyframe."""
    drive: Matrix
    """(K,) way since the first keyframe, dx / (f R), per px."""


def flow_of(tracks: Tracks, size_wh: tuple[int, int]) -> Flow | None:
    """The vanishing point under which the flow of most points is that of a pipe's wall.

    Returns:
        None if too few points were followed.
    """
    pairs = _pairs(tracks)
    if not any(len(before) for before, _ in pairs):
        return None
    size = np.array(size_wh, float)
    sharp_px = SHARP * size[0]
    best = (size - 1) / 2
    for share, places in _GRIDS:
        steps = np.linspace(-share / 2, share / 2, places)
        offered = [best + size * (u, v) for v in steps for u in steps]
        best = min(offered, key=lambda place: _cost(pairs, place, sharp_px))
    fits = [_fit(before, now, best, sharp_px) for before, now in pairs]
    drive = np.cumsum([0.0, *(fit[0] for fit, _ in fits)])
    turn = np.cumsum([np.zeros(2), *(fit[3:5] for fit, _ in fits)], axis=0)
    # The fit measured the flow from `best` in all keyframes; the vanishing point moves with the
    # turn, and best lies in their middle.
    return Flow(best + turn - turn.mean(axis=0), drive)


def _pairs(tracks: Tracks) -> list[tuple[Matrix, Matrix]]:
    """The places of common points in each keyframe and the next, (N, 2) px both."""
    pairs = []
    for k in range(len(tracks.t_s) - 1):
        now, then = (tracks.keyframe == k), (tracks.keyframe == k + 1)
        _, i, j = np.intersect1d(tracks.point[now], tracks.point[then], return_indices=True)
        if len(i) < LEAST_PAIR:
            i, j = i[:0], j[:0]
        pairs.append((tracks.uv_px[now][i], tracks.uv_px[then][j]))
    return pairs


def _cost(pairs: list[tuple[Matrix, Matrix]], place: Matrix, sharp_px: float) -> float:
    return -sum(float(_fit(*pair, place, sharp_px)[1].sum()) for pair in pairs)


def _fit(before: Matrix, now: Matrix, place: Matrix, sharp_px: float) -> tuple[Matrix, Matrix]:
    """The six terms of the flow about a vanishing point, and the weights of the points, (N,)."""
    if len(before) == 0:
        return np.zeros(6), np.empty(0)
    flow = now - before
    d = (before + now) / 2 - place  # of the middle: exact to the second order
    r = np.linalg.norm(d, axis=1)
    terms = np.zeros((len(d), 2, 6))
    terms[..., 0] = r[:, None] * d
    terms[..., 1], terms[..., 2] = d[:, :1] * d, d[:, 1:] * d
    terms[:, 0, 3] = terms[:, 1, 4] = 1.0
    terms[:, 0, 5], terms[:, 1, 5] = -d[:, 1], d[:, 0]
    scale = np.abs(terms).max(axis=(0, 1)) + 1e-12
    terms /= scale
    weight = np.ones(len(d))
    for _ in range(_TURNS):
        rows = terms * weight[:, None, None]
        normal = np.einsum("nai,naj->ij", rows, terms) + 1e-9 * len(d) * np.eye(6)
        found = np.linalg.solve(normal, np.einsum("nai,na->i", rows, flow))
        off = np.linalg.norm(flow - terms @ found, axis=1)
        weight = 1 / (1 + (off / sharp_px) ** 2)
    return found / scale, weight
