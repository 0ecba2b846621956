"""Draws the 95 % interval of the distance as a ring on the wall around the robot.

Shape and colour show the status: ok is a full ring with solid edges, weak has dashed edges, lost is
hatched between dotted edges.
"""

from __future__ import annotations

import viser

from app.survey.distances.interval import half_width_m
from app.viewer.geometry import Mesh, Section, dashed, strip, torus
from app.viewer.look import CameraMode
from vo_core.track import Estimate, Status

_COLORS: dict[Status, tuple[int, int, int]] = {
    "ok": (64, 214, 255),
    "weak": (255, 190, 60),
    "lost": (255, 84, 84),
}
_LEAST_HALF_WIDTH: dict[CameraMode, float] = {"overview": 0.06, "follow": 0.02, "inside": 0.02}
"""Smallest visible half-width, in scales of the section."""
_SIDES = 144


class Interval:
    """Three rings, one for each status, created once and then only moved and hidden."""

    def __init__(self, scene: viser.SceneApi, section: Section) -> None:
        self._scene = scene
        self._section = section
        size = section.scale_m
        inner = section.inset(0.015 * size)
        self._lift_m = 0.01 * size if section.radius_m is None else 0.0
        band, _ = strip(inner, *inner.arcs_m, sides=_SIDES)
        if section.radius_m is None:
            edge = Mesh((band.vertices - [0.5, 0, 0]) * [0.03 * size, 1, 1], band.faces)
        else:
            edge = torus(0.98 * section.radius_m, 0.022 * size, sides=_SIDES)
        dashes = dashed(edge, _SIDES, dashes=18, share=0.6)
        dots = dashed(edge, _SIDES, dashes=36, share=0.5)
        hatch = dashed(band, _SIDES, dashes=36, share=0.5)
        self._nodes: dict[Status, tuple[viser.MeshHandle, ...]] = {
            "ok": self._draw("ok", band, edge),
            "weak": self._draw("weak", band, dashes),
            "lost": self._draw("lost", hatch, dots),
        }
        self._status: Status | None = None

    def show(self, estimate: Estimate, mode: CameraMode) -> None:
        """Move the ring; it is to scale, with a smallest visible width."""
        x_m = estimate.distance_mm / 1000
        least_m = _LEAST_HALF_WIDTH[mode] * self._section.scale_m
        half_m = max(half_width_m(estimate.sigma_distance_mm), least_m)
        band, *edges = self._nodes[estimate.status]
        band.position = (x_m - half_m, 0.0, -self._lift_m)
        band.scale = (2 * half_m, 1.0, 1.0)
        for side, edge in zip((-1, 1), edges, strict=True):
            edge.position = (x_m + side * half_m, 0.0, -self._lift_m)
        if estimate.status != self._status:
            self._status = estimate.status
            for status, nodes in self._nodes.items():
                for node in nodes:
                    node.visible = status == estimate.status

    def _draw(self, status: Status, band: Mesh, edge: Mesh) -> tuple[viser.MeshHandle, ...]:
        def node(name: str, mesh: Mesh, opacity: float | None) -> viser.MeshHandle:
            return self._scene.add_mesh_simple(
                f"/interval/{status}/{name}",
                *mesh,
                color=_COLORS[status],
                opacity=opacity,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
                visible=False,
            )

        return node("band", band, 0.4), node("from", edge, None), node("to", edge, None)
