"""Measures tracked points again, on patches that are bent as the wall is seen from each keyframe.

A point followed from frame to frame drifts: a random walk of 0.2 px for each keyframe was measured
on rendered films, and its patch grows as the camera comes near.  Once lens and poses are roughly
known, the patch around a wall point can be resampled from every keyframe as one of them shows it,
and all of them be compared with that one (Lucas and Kanade, only the shift being sought).
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.film_rig.scene import Part, Scene
from vo_core.image.filters import BLACK_GREY, LIGHT_PX, low_pass, smooth
from vo_core.types import ByteImage, GrayImage, Matrix

HALF_PX = 9
"""Half side of a patch in the reference picture."""

LEAST_LIKENESS = 0.8
"""Least correlation of two patches."""

FURTHEST_PX = 4.0
"""Largest shift of an observation from where it was followed to or the model expects it."""

_STEPS = 6

_SIDE = np.arange(-HALF_PX, HALF_PX + 1, dtype=float)
_INSIDE = slice(2, -2)
"""Part of a patch that is compared; a gradient needs its neighbours."""


def measured_again(scene: Scene, lens: Matrix, part: Part) -> Part:
    """The part with refined observations; those that do not look alike are dropped."""
    tracks = part.tracks
    reference = _middle_observations(part)
    expected = scene.pixels(lens, part)
    offsets = scene.around(lens, part, reference, HALF_PX)  # (N, 3, 3, 2) px
    pictures = [_lit(image) for image in tracks.images]
    # The patch is placed where the reference was observed, in all keyframes as the model says.
    slip = (tracks.uv_px - expected)[reference][tracks.point]
    centre = expected + _carried(offsets, slip)
    shift = np.zeros((len(centre), 2))  # of the content, in px of the reference picture
    patches = _patches(pictures, tracks.keyframe, centre[:, None, None] + offsets, shift)
    wanted = _even(patches[reference][tracks.point][:, _INSIDE, _INSIDE])
    gu, gv = _gradient(patches[reference])
    rows = np.stack([gu, gv], -1).reshape(len(reference), -1, 2)
    rows -= rows.mean(axis=1, keepdims=True)
    scale = _spread(patches[reference][:, _INSIDE, _INSIDE])
    rows /= scale[:, None, None]
    normal = rows.swapaxes(1, 2) @ rows + 1e-6 * np.eye(2)
    gain = (np.linalg.inv(normal) @ rows.swapaxes(1, 2))[tracks.point]  # (N, 2, pixels)
    for _ in range(_STEPS):
        found = _even(patches[:, _INSIDE, _INSIDE])
        step = np.einsum("nip,np->ni", gain, (wanted - found).reshape(len(found), -1))
        shift += np.clip(step, -1.5, 1.5)
        shift = np.clip(shift, -2 * FURTHEST_PX, 2 * FURTHEST_PX)
        patches = _patches(pictures, tracks.keyframe, centre[:, None, None] + offsets, shift)
    found = _even(patches[:, _INSIDE, _INSIDE])
    likeness = (wanted * found).mean(axis=(1, 2))
    uv = centre + _carried(offsets, shift)
    good = (
        (likeness > LEAST_LIKENESS)
        & (np.linalg.norm(uv - tracks.uv_px, axis=1) < FURTHEST_PX)
        & (np.linalg.norm(step, axis=1) < 0.1)
    )
    return part.observed(uv).only(good)


def _middle_observations(part: Part) -> NDArray[np.intp]:
    """(P,) the observation in the middle of each track: nothing is magnified much against it."""
    ends = np.append(part.tracks.starts[1:], len(part.tracks.point))
    return np.asarray((part.tracks.starts + ends) // 2)


def _lit(image: ByteImage) -> GrayImage:
    """The picture without its lighting."""
    low = low_pass(image.astype(np.float32))
    return np.asarray(low / (smooth(low, LIGHT_PX) + np.float32(BLACK_GREY)), np.float32)


def _quadratic(at: Matrix) -> Matrix:
    """Weights of the places -1, 0, 1 for a value at `at`, (..., 3): a parabola through them."""
    return np.stack([at * (at - 1) / 2, 1 - at**2, at * (at + 1) / 2], -1)


def _carried(offsets: Matrix, shift: Matrix) -> Matrix:
    """(N, 2) shifts in each picture of shifts in the reference picture."""
    along, down = (_quadratic(shift[:, axis] / HALF_PX) for axis in (0, 1))
    return np.asarray(np.einsum("nj,ni,njiu->nu", down, along, offsets))


def _patches(
    pictures: list[GrayImage], keyframe: NDArray[np.intp], places: Matrix, shift: Matrix
) -> GrayImage:
    """(N, side, side) patches at 3 x 3 places each, (N, 3, 3, 2), shifted in the reference."""
    down = _quadratic((_SIDE + shift[:, 1:]) / HALF_PX)
    along = _quadratic((_SIDE + shift[:, :1]) / HALF_PX)
    uv = (down @ places.reshape(len(places), 3, 6)).reshape(len(places), -1, 3, 2)
    uv = np.einsum("nci,nriu->nrcu", along, uv).astype(np.float32)
    patches = np.empty(uv.shape[:3], np.float32)
    for k, picture in enumerate(pictures):
        own = np.flatnonzero(keyframe == k)
        for some in np.array_split(own, len(own) // 1000 + 1):  # remap takes 32767 rows at most
            columns, rows = np.moveaxis(uv[some].reshape(-1, len(_SIDE), 2), -1, 0)
            flat = cv2.remap(
                picture,
                np.ascontiguousarray(columns),
                np.ascontiguousarray(rows),
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
            patches[some] = flat.reshape(-1, len(_SIDE), len(_SIDE))
    return patches


def _gradient(patches: GrayImage) -> tuple[GrayImage, GrayImage]:
    """Central differences inside the patches, per px of the reference picture."""
    n = len(_SIDE)
    inner = slice(2, n - 2)
    gu = (patches[:, inner, 3 : n - 1] - patches[:, inner, 1 : n - 3]) / 2
    gv = (patches[:, 3 : n - 1, inner] - patches[:, 1 : n - 3, inner]) / 2
    return np.asarray(gu, np.float32), np.asarray(gv, np.float32)


def _spread(patches: GrayImage) -> GrayImage:
    return np.asarray(patches.std(axis=(1, 2)) + 1e-6)


def _even(patches: GrayImage) -> GrayImage:
    """Without mean and gain."""
    level = patches.mean(axis=(1, 2), keepdims=True)
    return np.asarray((patches - level) / _spread(patches)[:, None, None])
