"""The 3D scene follows tracking and tags; what it draws is looked at as a browser receives it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zstandard
from builders import Client
from websockets.sync.client import ClientConnection


def messages(socket: ClientConnection) -> list[dict[str, Any]]:
    """The next frame: raw size, compressed size, zstd of msgpack (viser 1.1.1)."""
    frame = socket.recv(20)
    assert isinstance(frame, bytes)
    raw, compressed = (int.from_bytes(frame[i : i + 8], "little") for i in (0, 8))
    packed = zstandard.decompress(frame[16 : 16 + compressed], max_output_size=raw)
    return list(msgspec.msgpack.decode(packed)["messages"])


def until(socket: ClientConnection, found: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """The first message that fits; receiving ends by a time-out."""
    while True:
        for message in messages(socket):
            if found(message):
                return message


def says(text: str) -> Callable[[dict[str, Any]], bool]:
    return lambda message: text in str(message)


def robot_moves(message: dict[str, Any]) -> bool:
    return message["type"] == "SetPositionMessage" and "robot" in message["name"]


def test_a_pin_appears_with_its_tag_and_goes_with_it(server: Client, clip: Path) -> None:
    inspection_id = server.tracked(clip)
    with server.view(inspection_id) as socket:
        tag = server.tag(inspection_id, frame=20, code="BAB", severity=3).json()
        until(socket, says("BAB"))
        server.delete(f"/api/inspections/{inspection_id}/observations/{tag['id']}")
        until(socket, lambda m: m.get("name") == "/pins/heads" and m.get("visible") is False)


def test_who_looks_at_a_deleted_inspection_is_no_fault(
    server: Client, clip: Path, caplog: pytest.LogCaptureFixture
) -> None:
    inspection_id = server.tracked(clip)
    with server.view(inspection_id) as socket:
        messages(socket)
        assert server.delete(f"/api/inspections/{inspection_id}").status_code == 204
    assert "failed" not in caplog.text


def test_who_opens_the_view_later_sees_the_tags(server: Client, clip: Path) -> None:
    inspection_id = server.tracked(clip)
    server.tag(inspection_id, frame=20, code="BBC")
    with server.view(inspection_id) as socket:
        until(socket, says("BBC"))


def test_the_robot_follows_the_tracking(server: Client, long_clip: Path) -> None:
    inspection_id = server.inspect(long_clip)
    with server.view(inspection_id) as socket:
        first = until(socket, lambda m: robot_moves(m) and m["position"][0] > 0.02)
        until(socket, lambda m: robot_moves(m) and m["position"][0] > first["position"][0] + 0.1)


def test_the_robot_goes_to_the_frame_that_the_player_shows(server: Client, clip: Path) -> None:
    inspection_id = server.tracked(clip)
    with (
        server.socket(f"/api/inspections/{inspection_id}/live") as live,
        server.view(inspection_id) as socket,
    ):
        live.send(json.dumps({"type": "show", "frame": 10}))
        until(socket, lambda m: robot_moves(m) and abs(m["position"][0] - 0.016) < 0.001)
        live.send(json.dumps({"type": "show", "frame": None}))
        until(socket, lambda m: robot_moves(m) and abs(m["position"][0] - 0.0624) < 0.001)


def test_the_tag_that_is_selected_in_the_list_is_marked(server: Client, clip: Path) -> None:
    inspection_id = server.tracked(clip)
    tag = server.tag(inspection_id, frame=20, code="BAB").json()
    with (
        server.socket(f"/api/inspections/{inspection_id}/live") as live,
        server.view(inspection_id) as socket,
    ):
        live.send(json.dumps({"type": "select", "observation": tag["id"]}))
        until(socket, says("» BAB"))
        live.send(json.dumps({"type": "select", "observation": None}))
        until(socket, lambda m: "'BAB" in str(m))


def test_a_stretch_is_a_band_from_its_start_to_its_finish(server: Client, clip: Path) -> None:
    inspection_id = server.tracked(clip)
    server.tag(inspection_id, frame=5, code="BAB", severity=2, continuous="A1")
    server.tag(inspection_id, frame=35, code="BAB", severity=2, continuous="B1")
    with server.view(inspection_id) as socket:
        until(socket, lambda m: m.get("name") == "/pins/patches/2")


def test_a_correction_moves_robot_path_wall_and_tags(server: Client, clip: Path) -> None:
    inspection_id = server.tracked(clip)
    server.tag(inspection_id, frame=0, code="BAB")
    stated = {
        "zero": {"frame": 0, "offset_m": 1.0},
        "lengths": [],
        "joints": {"use": False, "marked": [], "left_out": []},
        "rig_sigma": None,
        "forced": None,
        "remark": None,
    }
    with server.view(inspection_id) as socket:
        wall = until(socket, lambda m: m["type"] == "GlbMessage")["name"]
        raw_m = 0.5 * int(wall.split("/")[2])
        answer = server.put(f"/api/inspections/{inspection_id}/corrections", json=stated)
        assert answer.status_code == 200, answer.text
        waited = {
            "robot": lambda m: robot_moves(m) and abs(m["position"][0] - 1.0624) < 0.001,
            "wall": lambda m: (
                m["type"] == "SetPositionMessage"
                and m["name"] == wall
                and abs(m["position"][0] - raw_m - 1.0) < 0.01
            ),
            "tag": says("1.00 m ±"),
            "path": lambda m: m.get("name") == "/trail/0" and m["type"] == "LineSegmentsMessage",
        }
        while waited:
            for message in messages(socket):
                waited = {what: found for what, found in waited.items() if not found(message)}
