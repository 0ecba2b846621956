"""The 3D scene follows tracking and tags; what it draws is looked at as a browser receives it."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zstandard
from builders import PATIENCE_S, TOKEN, Client, serving, wait_until
from surveys import Survey
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from app.access.access import create_token
from app.errors import Busy
from app.inspections.corrections import Corrections
from app.inspections.observations import Observations
from app.storage.folder.tokens import Role, TokenFile
from app.survey.distances.track_rows import estimate_at
from app.survey.rounding import metres
from app.tracking.live import Live, Progress, Update
from app.viewer import scenes
from app.viewer.scene_feed import SceneFeed
from app.viewer.scenes import Scenes

OURS, THEIRS = "a" * 32, "b" * 32
"""Numbers of two pages."""


def look(client: Client, inspection_id: str, page: str = OURS) -> ClientConnection:
    return client.view(inspection_id, page)


def page(
    client: Client, inspection_id: str, page: str = OURS, token: str = TOKEN
) -> ClientConnection:
    return connect(
        f"{client.server.websocket_url}/api/inspections/{inspection_id}/live?page={page}",
        origin=client.server.url,  # type: ignore[arg-type]
        additional_headers={"Authorization": f"Bearer {token}"},
        max_size=None,
        open_timeout=PATIENCE_S,
    )


def command(live: ClientConnection, kind: str, **fields: Any) -> None:
    live.send(json.dumps({"type": kind} | fields))


def messages(socket: ClientConnection) -> list[dict[str, Any]]:
    """The next frame: raw size, compressed size, zstd of msgpack (viser 1.1.1)."""
    frame = socket.recv(PATIENCE_S)
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


def messages_until(
    socket: ClientConnection, found: Callable[[dict[str, Any]], bool]
) -> list[dict[str, Any]]:
    """All messages up to the frame that has one that fits."""
    seen: list[dict[str, Any]] = []
    while not any(map(found, seen)):
        seen += messages(socket)
    return seen


def says(text: str) -> Callable[[dict[str, Any]], bool]:
    return lambda message: text in str(message)


def robot_moves(message: dict[str, Any]) -> bool:
    return message["type"] == "SetPositionMessage" and "robot" in message["name"]


def test_a_pin_appears_with_its_tag_and_goes_with_it(server: Client, done: str) -> None:
    with look(server, done) as socket:
        tag = server.tag(done, frame=20, code="BAB", severity=3).json()
        until(socket, says("BAB"))
        server.delete(f"/api/inspections/{done}/observations/{tag['id']}")
        until(socket, lambda m: m.get("name") == "/pins/heads" and m.get("visible") is False)


def test_who_looks_at_a_deleted_inspection_is_no_fault(
    server: Client, done: str, caplog: pytest.LogCaptureFixture
) -> None:
    with look(server, done) as socket:
        messages(socket)
        assert server.delete(f"/api/inspections/{done}").status_code == 204
    assert "failed" not in caplog.text


def test_the_robot_follows_the_tracking(server: Client, long_clip: Path) -> None:
    inspection_id = server.inspect(long_clip)
    with look(server, inspection_id) as socket:
        first = until(socket, lambda m: robot_moves(m) and m["position"][0] > 0.02)
        until(socket, lambda m: robot_moves(m) and m["position"][0] > first["position"][0] + 0.1)


def test_the_robot_goes_to_the_frame_that_the_player_shows(server: Client, done: str) -> None:
    with (
        page(server, done) as live,
        look(server, done) as socket,
    ):
        command(live, "show", frame=10)
        until(socket, lambda m: robot_moves(m) and abs(m["position"][0] - 0.016) < 0.001)
        command(live, "show", frame=None)
        until(socket, lambda m: robot_moves(m) and abs(m["position"][0] - 0.0624) < 0.001)


@pytest.mark.parametrize("theirs", [THEIRS, OURS])
def test_nobody_moves_the_view_of_another_page(server: Client, done: str, theirs: str) -> None:
    """Robot, camera and marked tag of a page are its own, even if a viewer knew its number."""
    tag = server.tag(done, frame=20, code="BAB").json()
    token = create_token(TokenFile(server.data), "looker", Role.VIEWER)
    with (
        page(server, done) as ours,
        look(server, done) as socket,
        page(server, done, theirs, token) as viewer,
    ):
        command(ours, "show", frame=10)
        until(socket, lambda m: robot_moves(m) and abs(m["position"][0] - 0.016) < 0.001)
        command(viewer, "show", frame=30)
        command(viewer, "camera", mode="inside")
        command(viewer, "select", observation=tag["id"])
        command(viewer, "words", language="ms", units="ft")
        command(viewer, "ping", t=1.0)
        while not isinstance(viewer.recv(PATIENCE_S), str):  # the pong: all of it has been taken
            pass
        command(ours, "select", observation=tag["id"])
        seen = messages_until(socket, says("» BAB"))
        command(ours, "show", frame=11)
        seen += messages_until(socket, robot_moves)
    places_m = [m["position"][0] for m in seen if robot_moves(m)]
    assert places_m == pytest.approx([0.0176] * len(places_m), abs=0.001)
    assert [m["type"] for m in seen if m["type"] == "FogMessage" and m["enabled"]] == []
    assert " ft" not in str(seen)


def test_what_a_page_wished_before_its_view_came_is_done(server: Client, done: str) -> None:
    with page(server, done) as live:
        command(live, "show", frame=10)
        command(live, "ping", t=1.0)
        while not isinstance(live.recv(PATIENCE_S), str):
            pass
        with look(server, done) as socket:
            until(socket, lambda m: robot_moves(m) and abs(m["position"][0] - 0.016) < 0.001)


def test_clicks_measure_while_the_page_measures(server: Client, done: str) -> None:
    with page(server, done) as live, look(server, done) as socket:

        def click(x_m: float) -> None:
            ray = {"ray_origin": (x_m, 0.0, -0.05), "ray_direction": (0.0, 0.0, 1.0)}
            message = {"type": "ScenePointerMessage", "event_type": "click"} | ray
            socket.send(msgspec.msgpack.encode(message))

        command(live, "measure", on=True)
        until(socket, lambda m: m["type"] == "ScenePointerEnableMessage" and None in m["modifiers"])
        click(0.1)
        until(socket, lambda m: m.get("name") == "/ruler/0" and m.get("visible") is True)
        click(0.3)
        until(socket, says("≈ 200 mm"))
        command(live, "measure", on=False)
        until(socket, lambda m: m.get("name") == "/ruler/label" and m.get("visible") is False)
        click(0.4)
        while not isinstance(clicked := live.recv(PATIENCE_S), str):
            pass
        assert json.loads(clicked)["distance_m"] == pytest.approx(0.4)  # of the others it got none


def test_labels_are_in_the_language_and_unit_of_the_page(server: Client, done: str) -> None:
    server.tag(done, frame=20, code="BAB", char1="C", char2="A")
    with page(server, done) as live, look(server, done) as socket:
        until(socket, says("Crack"))
        command(live, "words", language="ms", units="ft")
        until(socket, says("Retak"))
        with look(server, done, THEIRS) as other:
            until(other, says("Crack"))
    with page(server, done) as live, look(server, done) as socket:
        command(live, "words", language="ms", units="ft")
        until(socket, lambda m: "robot_label" in str(m) and " ft ± 0.1 ft" in str(m))


def test_each_update_stands_on_the_page_and_in_its_view_at_once(server: Client, done: str) -> None:
    """While a film is tracked: nothing of an update waits for the next."""
    services = server.server.app.state.services
    track = services[Corrections].track(done)
    with page(server, done) as live, look(server, done) as socket:
        for frame in (12, 24, 36):
            estimate = estimate_at(track, frame)
            services[Live].publish(
                Update(done, "running", Progress(40, 40, None, None), (estimate,))
            )
            until(socket, says(f"'text': '{metres(estimate.distance_mm):.3f} m"))
            assert distance_mm_of(live, frame) == pytest.approx(estimate.distance_mm)


def distance_mm_of(live: ClientConnection, frame: int) -> float:
    """What the page is sent of this frame."""
    while True:
        message = live.recv(PATIENCE_S)
        if isinstance(message, bytes):
            header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "big")])
            command(live, "ack", seq=header["seq"])
            if header["frame"] == frame:
                return float(header["distance_mm"])


def test_a_view_that_is_drawn_seldom_shows_no_distance(server: Client, done: str) -> None:
    with page(server, done) as live, look(server, done) as socket:
        command(live, "words", language="en", units="m", late=True)
        until(socket, lambda m: m.get("name") == "/robot_label" and m.get("visible") is False)
        command(live, "words", language="en", units="m")
        until(socket, lambda m: m.get("name") == "/robot_label" and m.get("visible") is True)


def test_a_view_that_nobody_looks_at_is_closed(
    survey: Survey, done: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scenes, "_CLOSE_UNUSED_AFTER_S", 0.0)
    monkeypatch.setattr("app.container.SWEEP_S", 0.05)

    def look_and_leave(number: int) -> None:
        with look(server, done, f"{number:032x}") as socket:
            messages(socket)
        wait_until(lambda: server.server.app.state.services[Scenes].count() == 0)
        wait_until(lambda: viewer_threads() == [])

    with serving(survey.copied_to(tmp_path / "data")) as server, page(server, done):
        look_and_leave(0)
        before = threading.active_count()  # with those of the server that work for all views
        for number in range(1, 7):
            look_and_leave(number)
        assert threading.active_count() <= before + 2


def viewer_threads() -> list[str]:
    return [t.name for t in threading.enumerate() if t.name.startswith("scene-")]


def test_views_are_so_many_at_the_most(
    server: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scenes, "MOST_OPEN", 1)
    with look(server, done) as socket:
        messages(socket)
        with pytest.raises(InvalidStatus) as refused:
            look(server, done, THEIRS)
    assert refused.value.response.status_code == 503


def test_a_stretch_is_a_band_from_its_start_to_its_finish(server: Client, done: str) -> None:
    server.tag(done, frame=5, code="BAB", severity=2, continuous="A1")
    server.tag(done, frame=35, code="BAB", severity=2, continuous="B1")
    with look(server, done) as socket:
        until(socket, lambda m: m.get("name") == "/pins/patches/2")


def test_a_correction_moves_robot_path_wall_and_tags(server: Client, done: str) -> None:
    server.tag(done, frame=0, code="BAB")
    stated = {
        "zero": {"frame": 0, "offset_m": 1.0},
        "lengths": [],
        "joints": {"use": False, "marked": [], "left_out": []},
        "rig_sigma": None,
        "forced": None,
        "remark": None,
    }
    with look(server, done) as socket:
        wall = until(socket, lambda m: m["type"] == "GlbMessage")["name"]
        raw_m = 0.5 * int(wall.split("/")[2])
        answer = server.put(f"/api/inspections/{done}/corrections", json=stated)
        assert answer.status_code == 200, answer.text
        waited = {
            "robot": lambda m: robot_moves(m) and abs(m["position"][0] - 1.0624) < 0.001,
            "wall": lambda m: (
                m["type"] == "SetPositionMessage"
                and m["name"] == wall
                and abs(m["position"][0] - raw_m - 1.0) < 0.01
            ),
            "tag": lambda m: (
                m["type"] == "SetPositionMessage"
                and m["name"] == "/pins/labels/0"
                and abs(m["position"][0] - 1.0) < 0.01
            ),
            "path": lambda m: m.get("name") == "/trail/0" and m["type"] == "LineSegmentsMessage",
        }
        while waited:
            for message in messages(socket):
                waited = {what: found for what, found in waited.items() if not found(message)}


def test_a_tag_does_not_wait_for_its_pin_and_the_newest_pins_stay(
    server: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    observations = server.server.app.state.services[Observations]
    read_all, is_read, may_go_on = observations.all, threading.Event(), threading.Event()

    def slowly(done: str) -> list[Any]:
        views = read_all(done)
        if views:
            is_read.set()
            may_go_on.wait(PATIENCE_S)
        return list(views)

    with look(server, done) as socket:
        messages(socket)
        monkeypatch.setattr(observations, "all", slowly)
        server.tag(done, frame=20, code="BAB")
        assert is_read.wait(PATIENCE_S)
        server.tag(done, frame=30, code="BBC")  # while the pins of the first are drawn
        monkeypatch.setattr(observations, "all", read_all)
        may_go_on.set()
        until(socket, says("BBC"))


def test_a_drawing_that_failed_is_drawn_again(
    server: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    observations = server.server.app.state.services[Observations]
    read_all, failed = observations.all, threading.Event()

    def fail_once(inspection_id: str) -> list[Any]:
        if failed.is_set():
            return list(read_all(inspection_id))
        failed.set()
        raise Busy("The database is busy.")

    with look(server, done) as socket:
        messages(socket)
        monkeypatch.setattr(observations, "all", fail_once)
        server.tag(done, frame=20, code="BAB")
        until(socket, says("BAB"))
    assert failed.is_set()


def test_a_page_that_comes_while_a_rig_changes_leaves_no_old_view(
    server: Client, done: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    services, close = server.server.app.state.services, SceneFeed.close

    def close_when_another_page_has_come(feed: SceneFeed) -> None:
        monkeypatch.setattr(SceneFeed, "close", close)
        with page(server, done, "c" * 32):
            close(feed)

    rig = server.get(f"/api/inspections/{done}").json()["rig"]
    with look(server, done) as mine, look(server, done, THEIRS) as theirs:
        messages(mine)
        messages(theirs)
        monkeypatch.setattr(SceneFeed, "close", close_when_another_page_has_come)
        answer = server.put(f"/api/inspections/{done}/rig", json={"rig": rig})
        assert answer.status_code == 200, answer.text
        wait_until(lambda: services[Scenes].count() == 0)  # in the background, after the answer
