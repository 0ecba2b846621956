"""The seen part of the wall: pictures of the developed wall, mapped back onto it.

Every picture is sent once, and again only when it has changed; a corrected distance moves its node.
A browser stores each as a texture (4/3 of 4 bytes a pixel), so that in a long culvert only the part
around the robot shows pictures.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import viser

from app.viewer.geometry import Cut, Section, strip
from app.viewer.glb import textured_glb
from vo_core.mosaic.layout import Layout

MAX_PIXELS = 24_000_000
"""Most pixels of all pictures together: 128 MB of textures, and 360 MB of Chromium where it draws
without a graphics card."""

_MAX_PER_TICK = 4
"""Most pictures sent per tick, so that pose and live picture are not delayed when a culvert is
opened."""
_PERIOD_S = 2.0
"""Shortest time between two versions of a growing picture, s."""


@dataclass(frozen=True, slots=True)
class WallTile:
    """A picture of a part of the wall, and its present place."""

    index: int
    revision: int
    """A different revision means a different picture."""
    from_m: float
    to_m: float


ReadPicture = Callable[[int], bytes | None]
"""Returns the JPEG of a tile by its index; None if it has just been removed."""


@dataclass(frozen=True, slots=True)
class WallPictures:
    """All tiles of a wall, and access to their pictures."""

    tiles: Sequence[WallTile]
    layout: Layout
    read: ReadPicture

    @classmethod
    def placed(
        cls,
        revisions: Mapping[int, int],
        layout: Layout,
        chainage_mm: Callable[[float], float],
        read: ReadPicture,
    ) -> WallPictures:
        """Place tiles, by their index and revision, at their corrected distances."""

        def border_m(index: int) -> float:
            return chainage_mm(index * layout.tile_mm) / 1000

        tiles = [WallTile(n, at, border_m(n), border_m(n + 1)) for n, at in revisions.items()]
        return cls(tiles, layout, read)


@dataclass(slots=True)
class _Drawn:
    handle: viser.GlbHandle
    revision: int
    sent_at_s: float
    """time.monotonic"""
    place_m: tuple[float, float]


class TexturedWall:
    """Shows the pictures nearest the robot; used by one thread."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        self._cut: Cut = "none"
        self._layout: Layout | None = None
        self._read: ReadPicture = lambda _: None
        self._tiles: dict[int, WallTile] = {}
        self._drawn: dict[int, _Drawn] = {}
        self._due_s: float | None = None

    def set(self, pictures: WallPictures) -> None:
        """Replace the tiles; `update` draws them."""
        if pictures.layout != self._layout:
            self._remove(list(self._drawn))
        self._layout, self._read = pictures.layout, pictures.read
        self._tiles = {tile.index: tile for tile in pictures.tiles}
        self._remove([index for index in self._drawn if index not in self._tiles])
        for index, drawn in self._drawn.items():
            _move(drawn, self._tiles[index])

    def set_cut(self, cut: Cut) -> None:
        """Cut the pictures with the wall; `update` draws what is left of them."""
        if cut != self._cut:
            self._cut = cut
            self._remove(list(self._drawn))

    def _kept_m(self, layout: Layout) -> tuple[float, float] | None:
        """Return first and last arc of the pictures that the cut leaves; None if nothing."""
        first_m, last_m = self._section.kept_arcs_m(self._cut)
        first_m, last_m = (
            max(first_m, layout.arc_from_mm / 1000),
            min(last_m, layout.arc_to_mm / 1000),
        )
        return (first_m, last_m) if first_m < last_m else None

    def due_in_s(self) -> float | None:
        """Return the time until `update` has work; None if not before the next change."""
        return None if self._due_s is None else max(0.0, self._due_s - time.monotonic())

    def update(self, robot_x_m: float) -> None:
        """Send the next few pictures, the nearest to the robot first."""
        self._due_s = None
        if self._layout is None or self._kept_m(self._layout) is None:
            return
        room = max(1, MAX_PIXELS // (self._layout.width_px * self._layout.height_px))
        by_distance = sorted(
            self._tiles.values(), key=lambda tile: abs((tile.from_m + tile.to_m) / 2 - robot_x_m)
        )
        sent = 0
        for tile in by_distance[:room]:
            wait_s = self._wait_s(tile)
            if wait_s is None:
                continue
            if wait_s == 0.0 and sent < _MAX_PER_TICK:
                self._send(tile, self._layout)
                sent += 1
            else:
                self._due_s = min(self._due_s or float("inf"), time.monotonic() + wait_s)
        # Distant tiles stay until near ones need their memory.
        kept = [tile.index for tile in by_distance if tile.index in self._drawn]
        self._remove(kept[room:])

    def _wait_s(self, tile: WallTile) -> float | None:
        """Return the time until its picture may be sent; None if there is no need."""
        drawn = self._drawn.get(tile.index)
        if drawn is None:
            return 0.0
        if drawn.revision == tile.revision:
            return None
        return max(0.0, drawn.sent_at_s + _PERIOD_S - time.monotonic())

    def _send(self, tile: WallTile, layout: Layout) -> None:
        jpeg = self._read(tile.index)
        kept_m = self._kept_m(layout)
        if jpeg is None or kept_m is None:
            return
        mesh, uv = strip(self._section, *kept_m)
        first_m, last_m = layout.arc_from_mm / 1000, layout.arc_to_mm / 1000
        v = kept_m[0] - first_m + uv[:, 1] * (kept_m[1] - kept_m[0])
        uv[:, 1] = v / (last_m - first_m)
        glb = textured_glb(mesh, uv, jpeg)
        drawn = self._drawn.get(tile.index)
        if drawn is not None:
            drawn.handle.glb_data = glb
            drawn.revision, drawn.sent_at_s = tile.revision, time.monotonic()
            return
        handle = self._scene.add_glb(
            f"/wall/{tile.index}",
            glb,
            cast_shadow=False,
            receive_shadow=False,
            position=_position(tile),
            scale=_scale(tile),
        )
        self._drawn[tile.index] = _Drawn(
            handle, tile.revision, time.monotonic(), (tile.from_m, tile.to_m)
        )

    def _remove(self, indices: Sequence[int]) -> None:
        for index in indices:
            self._drawn.pop(index).handle.remove()


def _move(drawn: _Drawn, tile: WallTile) -> None:
    place_m = (tile.from_m, tile.to_m)
    if place_m != drawn.place_m:
        drawn.handle.position, drawn.handle.scale = _position(tile), _scale(tile)
        drawn.place_m = place_m


def _position(tile: WallTile) -> tuple[float, float, float]:
    return (tile.from_m, 0.0, 0.0)


def _scale(tile: WallTile) -> tuple[float, float, float]:
    return (tile.to_m - tile.from_m, 1.0, 1.0)
