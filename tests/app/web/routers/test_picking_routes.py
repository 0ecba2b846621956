"""Clicks in the 3D view reach the page around it; clicks on a map of the wall lead to a frame."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import pytest
import zstandard
from builders import PATIENCE_S, STEP_MM, TOKEN, WIDTH, Client, assert_error
from websockets.sync.client import ClientConnection, connect

RIGHT_MM = 20.0


class Browser:
    """One log-in, any number of sockets."""

    def __init__(self, client: Client) -> None:
        self._server = client.server
        visitor = client.anonymous()
        visitor.post("/api/login", json={"token": TOKEN})
        self._visitor = visitor
        self._cookie = visitor.cookies[visitor.cookie_name]

    def live(self, inspection_id: str) -> ClientConnection:
        """From its first message on it hears the clicks."""
        socket = self._open(f"/api/inspections/{inspection_id}/live")
        socket.recv(PATIENCE_S)
        return socket

    def view(self, inspection_id: str) -> ClientConnection:
        return self._visitor.view(inspection_id)

    def _open(self, path: str, **options: Any) -> ClientConnection:
        return connect(
            self._server.websocket_url + path,
            origin=self._server.url,
            additional_headers={"Cookie": f"{self._visitor.cookie_name}={self._cookie}"},
            max_size=None,
            open_timeout=PATIENCE_S,
            **options,
        )


def wait_for(view: ClientConnection, text: bytes) -> None:
    """Until the scene has drawn something with this text."""
    drawn = b""
    while text not in drawn:
        frame = view.recv(PATIENCE_S)
        assert isinstance(frame, bytes)
        raw, packed = (int.from_bytes(frame[i : i + 8], "little") for i in (0, 8))
        drawn = zstandard.decompress(frame[16 : 16 + packed], max_output_size=raw)


def shift_click(view: ClientConnection, at_m: tuple[float, float]) -> None:
    """Onto the floor, straight from above."""
    message = {
        "type": "ScenePointerMessage",
        "event_type": "click",
        "ray_origin": (*at_m, -1.0),
        "ray_direction": (0.0, 0.0, 1.0),
    }
    view.send(msgspec.msgpack.encode(message))


def next_message(live: ClientConnection) -> dict[str, Any]:
    """The next text message."""
    while True:
        message = live.recv(PATIENCE_S)
        if isinstance(message, str):
            return dict(json.loads(message))


def test_click_on_the_wall_reaches_the_page_of_the_same_browser(shared: Client, done: str) -> None:
    mine, other = Browser(shared), Browser(shared)  # pins of other tests lie elsewhere
    with mine.live(done) as page, other.live(done) as stranger, mine.view(done) as view:
        shift_click(view, (0.03, -0.2))
        assert next_message(page) == {
            "type": "wall_click",
            "distance_m": 0.03,
            "clock_h": None,
            "lateral_m": -0.2,
        }
        with other.view(done) as their_view:
            shift_click(their_view, (0.04, -0.2))
        assert next_message(stranger)["distance_m"] == 0.04


def test_click_on_a_pin_is_reported_as_its_observation(shared: Client, own: str) -> None:
    tag = shared.tag(own, frame=20, code="BAB").json()
    browser = Browser(shared)
    with browser.live(own) as page, browser.view(own) as view:
        wait_for(view, b"BAB")
        shift_click(view, (tag["distance_m"], 0.0))
        assert next_message(page) == {"type": "pin_click", "observation": tag["id"]}


def test_click_that_no_page_waits_for_is_dropped(shared: Client, done: str) -> None:
    browser = Browser(shared)
    with browser.view(done) as view:
        shift_click(view, (0.03, -0.2))
        with browser.live(done) as page:
            shift_click(view, (0.04, -0.2))
            assert next_message(page)["distance_m"] == 0.04


def test_place_leads_to_the_frame_that_shows_it_best(shared: Client, done: str) -> None:
    place = {"distance_m": 20 * STEP_MM / 1000, "y_mm": RIGHT_MM}
    seen = shared.get(f"/api/inspections/{done}/frame-at", params=place).json()
    tag = shared.tag(done, frame=seen["frame"], pixel=seen["pixel"]).json()

    assert seen["frame"] == 20
    assert seen["pixel"][0] == pytest.approx((WIDTH - 1) / 2, abs=2)
    assert tag["distance_m"] == pytest.approx(place["distance_m"], abs=1e-4)


def test_place_without_all_its_coordinates_is_refused(shared: Client, done: str) -> None:
    at = f"/api/inspections/{done}/frame-at"
    assert "y_mm" in assert_error(
        shared.get(at, params={"distance_m": 0.1, "clock": 6}), 422, "incomplete_wall_point"
    )
    assert_error(shared.get(at, params={"y_mm": 1}), 422, "invalid_request")
    assert_error(shared.get(at, params={"distance_m": "nan", "y_mm": 1}), 422, "invalid_request")
