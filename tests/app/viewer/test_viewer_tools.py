"""Tools of the 3D view: section cut, ruler, scale bar, and the pin under the pointer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from viewer_client import Served, is_sent

from app.survey.places.measure import Figure
from app.viewer.geometry import Cut, Section, WallHit, cut_away, half_shell, torus
from app.viewer.pin import Pin
from app.viewer.ruler import shortest
from app.viewer.scale_bar import round_length_m
from app.viewer.wall import WallPictures, WallTile
from app.viewer.wording import Wording
from vo_core.mosaic.layout import Layout

PIPE = Section(radius_m=0.15, half_width_m=0.15)
REACH = (0.0, 10.0)


def point(distance_m: float, clock_h: float) -> WallHit:
    return WallHit(distance_m, clock_h, 0.0)


@pytest.mark.parametrize(("cut", "angles"), [("top", (-90, 90)), ("side", (-180, 0))])
def test_a_cut_leaves_one_half_with_the_thickness_of_the_wall(
    cut: Cut, angles: tuple[float, float]
) -> None:
    first, last = (arc_m / 0.15 for arc_m in PIPE.kept_arcs_m(cut))
    shell, collar = half_shell(0.15, 0.01, first, last), cut_away(torus(0.16, 0.01), first, last)

    assert np.degrees([first, last]) == pytest.approx(angles)
    _, y, z = shell.vertices.T
    assert sorted(set(np.hypot(y, z).round(6))) == [0.15, 0.16]
    inside = (z if cut == "top" else -y) >= -1e-9
    assert inside.all()
    middles = collar.vertices[collar.faces].mean(axis=1)
    assert ((middles[:, 2] if cut == "top" else -middles[:, 1]) >= 0).all()


def test_a_click_through_the_cut_meets_what_is_left() -> None:
    above, down = (1.0, 0.0, -2.0), (0.0, 0.0, 1.0)
    below, up = (1.0, 0.0, 2.0), (0.0, 0.0, -1.0)

    hit = PIPE.hit(above, down, REACH, "top")
    outside = PIPE.hit(below, up, REACH, "top")
    whole = PIPE.hit(below, up, REACH)
    assert hit is not None
    assert outside is not None
    assert whole is not None
    assert hit.clock_h == outside.clock_h == pytest.approx(6.0)
    assert whole.clock_h == pytest.approx(12.0)  # the near wall of a whole pipe is not drawn
    assert PIPE.hit((1.0, 0.0, 0.0), up, REACH, "top") is None


def test_the_ruler_goes_the_shortest_way_along_the_wall() -> None:
    along, around = shortest(PIPE, point(1.0, 11.0), point(1.3, 1.0))
    assert along == pytest.approx(0.3)
    assert abs(around) == pytest.approx(0.15 * np.pi / 3)  # over the crown, not through the invert
    floor = Section(radius_m=None, half_width_m=0.7)
    assert shortest(floor, WallHit(1, None, -0.1), WallHit(1, None, 0.2)) == pytest.approx((0, 0.3))


@pytest.mark.parametrize(
    ("most_m", "unit_m", "length_m"),
    [(0.225, 1.0, 0.2), (0.5, 1.0, 0.5), (9.9, 1.0, 5.0), (0.4, 0.3048, 0.3048)],
)
def test_the_scale_bar_has_a_round_length(most_m: float, unit_m: float, length_m: float) -> None:
    assert round_length_m(most_m, unit_m) == pytest.approx(length_m)


def label(client: Any, name: str, text: str) -> None:
    client.until(
        lambda m: m.get("name") == name and m.get("updates", m.get("props", {})).get("text") == text
    )


def test_two_clicks_measure_and_a_third_begins_anew(served: Served) -> None:
    scene = served.scene
    with served.client() as client:
        client.replay()
        scene.set_measuring(True)
        scene.measure_to(point(1.0, 6.0))
        scene.measure_to(point(1.2, 6.0))
        label(client, "/ruler/label", "≈ 200 mm")
        figure = Figure("length", 198.2, 3.4, None, None)
        scene.set_size((point(1.0, 6.0), point(1.1, 6.0)), figure)  # of another line: too late
        scene.set_size((point(1.0, 6.0), point(1.2, 6.0)), figure)
        label(client, "/ruler/label", "198 ± 4 mm")
        scene.show(wording=Wording(units="ft"))
        label(client, "/ruler/label", "0.65 ± 0.02 ft")
        scene.measure_to(point(3.0, 6.0))
        client.until(lambda m: m.get("name") == "/ruler/label" and m.get("visible") is False)
        scene.set_measuring(False)
        client.until(lambda m: m.get("name") == "/ruler/0" and m.get("visible") is False)


def test_in_a_low_window_only_the_selected_pin_is_labelled(served: Served) -> None:
    pins = [Pin("1", 0.1, 6.0, None, 3, "BAB Crack"), Pin("2", 0.2, 6.0, None, 2, "BBA")]
    with served.client() as client:
        client.replay()
        client.send_camera()
        served.scene.show(pins=pins)
        label(client, "/pins/labels/1", "S2 BBA")
        client.send_camera(image_height=150)
        client.until(lambda m: m.get("name") == "/robot_label" and m.get("visible") is False)
        served.scene.show(selected="2")
        label(client, "/pins/labels/0", "» S2 BBA")
        client.send_camera()
        client.until(lambda m: m.get("name") == "/robot_label" and m.get("visible") is True)


def test_a_cut_sends_what_is_left_of_the_pictures(served: Served) -> None:
    half_mm = 150 * np.pi
    tiles = [WallTile(0, 1, 0.0, 0.5)]
    served.scene.show(
        wall=WallPictures(
            tiles, Layout(500, 8, -half_mm, half_mm, 64, 64), lambda _: b"\xff\xd8\xff\xd9"
        )
    )
    with served.client() as client:
        whole = client.until(lambda m: m["type"] == "GlbMessage")[-1]
        served.scene.show(cut="side")
        left = client.until(lambda m: m["type"] == "GlbMessage")[-1]

    assert left["name"] == whole["name"] == "/wall/0"
    assert left["props"]["glb_data"] != whole["props"]["glb_data"]


def test_the_pin_under_the_pointer_is_labelled(served: Served) -> None:
    """One that is far away: from inside it is just above the middle of the picture."""
    served.scene.show(pins=[Pin("far", 8.0, 12, 0.01, 4, "BAC")])
    with served.client() as client:
        client.send_camera()
        served.scene.show(mode="inside")
        client.until(lambda m: is_sent(m) and m["position"][0] == pytest.approx(-2.2 * 0.15))
        served.scene.show(pointer=(0.5, 0.49))
        label(client, "/pins/labels/0", "S4 BAC\n8.00 m ± 0.01 m")
        served.scene.show(pointer=(0.5, 0.7))
        client.until(lambda m: m.get("name") == "/pins/labels/0" and m.get("visible") is False)
