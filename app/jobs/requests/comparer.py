"""The process that compares the unrolled walls of two surveys, then ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits, Progress
from vo_core.alignment.wall_map import WallMap

_STEPS = 1000


class WallFiles(msgspec.Struct, frozen=True):
    """An unrolled wall on this machine."""

    rig: dict[str, Any]
    tiles: dict[int, str]
    """Path of each tile."""


class CompareRequest(msgspec.Struct, frozen=True):
    """Align two walls; the answer is a `WallMap`."""

    earlier: WallFiles
    later: WallFiles
    limits: Limits


def _compare(request: CompareRequest, parent: Parent) -> WallMap:
    # Imported here so that the decoders are loaded under the limits.
    from vo_core.alignment.align import align

    def report(share: float) -> None:
        parent.send(Progress(round(_STEPS * share), _STEPS))

    return align(_wall(request.earlier), _wall(request.later), report)


def _wall(files: WallFiles) -> Any:
    import math

    import cv2
    import numpy as np

    from vo_core import Rig
    from vo_core.alignment.raster import Wall
    from vo_core.mosaic.layout import Layout
    from vo_core.types import ByteImage

    def read(index: int) -> ByteImage | None:
        if index not in files.tiles:
            return None
        jpeg = np.frombuffer(Path(files.tiles[index]).read_bytes(), np.uint8)
        picture = cv2.imdecode(jpeg, cv2.IMREAD_COLOR)
        return None if picture is None else np.asarray(picture, np.uint8)

    rig = Rig.parse(files.rig)
    radius_mm = rig.pipe.radius_mm
    girth_mm = None if radius_mm is None else 2 * math.pi * radius_mm
    tiles = range(min(files.tiles), max(files.tiles) + 1)
    return Wall(Layout.of(rig), girth_mm, tiles, read)


def _folders(request: CompareRequest) -> list[str]:
    paths = [*request.earlier.tiles.values(), *request.later.tiles.values()]
    return sorted({str(Path(path).parent) for path in paths})


if __name__ == "__main__":
    serve(CompareRequest, _compare, named="Comparing the walls", reads=_folders)
