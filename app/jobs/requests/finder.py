"""The process that searches an unrolled wall with one detector, or tries out a user's model."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits

if TYPE_CHECKING:  # loaded under the limits
    from vo_core.findings.finding import Detector, Finding, Size
    from vo_core.mosaic.layout import Layout
    from vo_core.mosaic.mosaic import Tile

_UNSEEN_WITHIN = 10
"""A tile is a JPEG: what was not seen has nearly the grey of unseen wall."""
_LEAST_UNSEEN_PX = 15
"""A smaller place of that grey is wall that has this colour."""
_TILES_HELD = 4
_NICENESS = 19
"""It gets what processor time the trackers leave."""
_MOST_POINTS = 200
"""Points of an outline that are kept."""

_Mm = Annotated[float, msgspec.Meta(ge=-1e8, le=1e8)]
_Sigma = Annotated[float, msgspec.Meta(ge=0, le=1e8)]


class FoundSize(msgspec.Struct, frozen=True):
    """A length with its standard uncertainty."""

    mm: _Sigma
    sigma_mm: _Sigma


class Found(msgspec.Struct, frozen=True):
    """A finding, as in `vo_core.findings`."""

    kind: Annotated[str, msgspec.Meta(pattern="^[a-z][a-z0-9_]{0,39}$")]
    outline_mm: Annotated[
        list[tuple[_Mm, _Mm]], msgspec.Meta(min_length=1, max_length=_MOST_POINTS)
    ]
    length: FoundSize | None
    width: FoundSize | None
    direction: Literal["along", "across", "oblique"] | None
    score: Annotated[float, msgspec.Meta(ge=0, le=1)]


class Searched(msgspec.Struct, frozen=True):
    """Child to parent: what is complete by now."""

    found: list[Found]
    to_mm: float
    """Raw axial coordinate up to which the wall was searched."""


class ModelFile(msgspec.Struct, frozen=True):
    """A user's model."""

    path: str
    declared: bytes
    """`app.survey.findings.declaration.Declaration` as JSON."""


class FinderRequest(msgspec.Struct, frozen=True):
    """Search a wall: `Searched` comes before the answer, which is the version of the detector."""

    limits: Limits
    rig: dict[str, Any] = {}
    tiles: dict[int, str] = {}
    """Paths of the tiles of the wall."""
    blocks: list[int] = []
    """Blocks of tiles to search, ascending."""
    model: ModelFile | None = None
    """None: the built-in detector."""
    is_check: bool = False
    """Whether to try out the model only."""


def _find(request: FinderRequest, parent: Parent) -> str:
    # Imported here so that OpenCV is loaded under the limits.
    from vo_core import Rig
    from vo_core.findings.patches import BLOCK_TILES, girth_of, patch_of
    from vo_core.findings.search import Search
    from vo_core.mosaic.layout import Layout

    detector, version = _detector(request)
    if request.is_check:
        return version
    os.nice(_NICENESS)
    rig = Rig.parse(request.rig)
    layout = Layout.of(rig)
    read = lru_cache(_TILES_HELD)(partial(_tile, layout, request.tiles))
    search, to_mm = Search(detector), 0.0
    for block in request.blocks:
        found = search.add(patch_of(layout, block, read, girth_mm=girth_of(rig, layout)))
        to_mm = (block + 1) * BLOCK_TILES * layout.tile_mm
        parent.send(Searched([_told(each) for each in found], to_mm))
    parent.send(Searched([_told(each) for each in search.finish()], to_mm))
    return version


def _detector(request: FinderRequest) -> tuple[Detector, str]:
    """Return the detector, and its version."""
    if request.model is None:
        from vo_core.findings.classical import VERSION, Classical

        return Classical(), VERSION
    import hashlib

    from app.jobs.detect.user_model import UserModel
    from app.survey.findings.declaration import Declaration

    content = Path(request.model.path).read_bytes()
    model = UserModel(content, Declaration.model_validate_json(request.model.declared))
    if request.is_check:
        model.try_out()
    return model, hashlib.sha256(content).hexdigest()[:8]


def _tile(layout: Layout, paths: Mapping[int, str], index: int) -> Tile | None:
    """Return a tile with a weight for what was seen; None if it is missing."""
    import cv2
    import numpy as np

    from vo_core.mosaic.layout import UNSEEN_GREY
    from vo_core.mosaic.mosaic import Tile

    try:
        content = Path(paths[index]).read_bytes()
    except (KeyError, FileNotFoundError):  # the inspection was deleted, or is tracked again
        return None
    picture = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    if picture is None or picture.shape[:2] != (layout.height_px, layout.width_px):
        return None
    off = np.abs(picture.astype(np.int16) - UNSEEN_GREY).max(axis=2)
    unseen = (off <= _UNSEEN_WITHIN).astype(np.uint8)
    side = np.ones((_LEAST_UNSEEN_PX, _LEAST_UNSEEN_PX), np.uint8)
    weight = 1 - cv2.morphologyEx(unseen, cv2.MORPH_OPEN, side)
    return Tile(index, np.asarray(picture, np.uint8), np.asarray(weight, np.float32))


def _told(finding: Finding) -> Found:
    points = [(round(x, 1), round(y, 1)) for x, y in finding.outline_mm.tolist()]
    step = -(-len(points) // (_MOST_POINTS - 1))
    kept = [*points[:-1:step], points[-1]]
    return Found(
        finding.kind,
        kept,
        _told_size(finding.length),
        _told_size(finding.width),
        finding.direction,
        finding.score,
    )


def _told_size(size: Size | None) -> FoundSize | None:
    return None if size is None else FoundSize(round(size.mm, 2), round(size.sigma_mm, 3))


if __name__ == "__main__":
    serve(
        FinderRequest,
        _find,
        named="Searching the wall",
        reads=lambda request: [
            *request.tiles.values(),
            *([request.model.path] if request.model else []),
        ],
    )
