import asyncio
import gc
import json
import stat
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import viser
import websockets.asyncio.server
from builders import PATIENCE_S, wait_until
from viewer_client import Client, Served, is_sent, late_joiner, make_estimate, make_rig
from viser._messages import RunJavascriptMessage
from viser.infra._async_message_buffer import AsyncMessageBuffer

from app.viewer import drawing, views, wall
from app.viewer.culvert import JointMark
from app.viewer.geometry import Section
from app.viewer.look import CameraMode
from app.viewer.pin import Pin
from app.viewer.private_server import ViewerUnavailable, start_private_server
from app.viewer.scene import CulvertScene
from app.viewer.views import View, view_of
from app.viewer.wall import WallPictures, WallTile
from vo_core.mosaic.layout import Layout

NEVER_S = 1e6
"""A period that no test outlasts."""
JPEG = b"\xff\xd8 not decoded on the server \xff\xd9"


def texts_of(messages: list[dict]) -> set[str]:
    """Texts of the labels that can be seen after these messages."""
    text, visible = {}, {}
    for message in messages:
        name = message.get("name")
        if message["type"] == "LabelMessage":
            text[name] = message["props"]["text"]
        elif message["type"] == "SceneNodeUpdateMessage" and "text" in message["updates"]:
            text[name] = message["updates"]["text"]
        elif message["type"] == "SetSceneNodeVisibilityMessage":
            visible[name] = message["visible"]
    return {shown for name, shown in text.items() if visible.get(name, True)}


def names_of(messages: list[dict]) -> set[str]:
    return {message["name"] for message in messages if message.get("name")}


def kind_of(message: dict) -> tuple:
    """Of the messages of one kind viser keeps the newest."""
    return message["type"], message.get("name"), *sorted(message.get("updates", ()))


def replay(served: Served) -> list[dict]:
    """What a late joiner gets after everything posted so far has been drawn."""
    mark = next(replay.marks)
    with served.client() as client:
        served.scene.show(pose=make_estimate(mark))
        client.until_robot_says(f"{mark / 1000:.3f} m")
    with served.client() as client:
        return client.replay()


replay.marks = iter(range(1, 1000))


def test_late_joiner_gets_the_whole_scene(served: Served) -> None:
    served.scene.show(length_m=4)
    served.scene.extend_path([0, 50, 100], [0, 0, 0], [1, 1, 1])
    served.scene.show(pins=[Pin("a", 0.25, 7.5, 0.004, 2, "BAF C")])
    served.scene.show(joints=[JointMark(1, 1.47, is_seen=True), JointMark(2, 2.97, is_seen=False)])
    served.scene.show(mode="follow")

    messages = replay(served)

    assert {"/culvert/wall", "/robot/camera/view", "/interval/ok/band", "/trail/0"} <= names_of(
        messages
    )
    assert {"S2 BAF C\n0.25 m ± 0.01 m", "joint 1 · 1.47 m"} <= texts_of(messages)
    assert "joint 2 · 2.97 m · expected" in texts_of(messages)


def test_scene_does_not_grow_with_frames(served: Served) -> None:
    served.scene.show(preview=JPEG)
    before = replay(served)
    with served.client() as client:
        for step in range(40):
            served.scene.show(pose=make_estimate(100 + step, status="weak" if step % 2 else "ok"))
            served.scene.extend_path([100 + 0.1 * step], [0.1], [1.0])
            served.scene.show(preview=JPEG + bytes([step]))
            client.until_robot_says(f"{(100 + step) / 1000:.3f} m")

    after = replay(served)

    # One message more at most for each property that had its first value until now.
    assert len(after) <= len(before) + 8
    assert names_of(after) - names_of(before) <= {"/trail/0"}


def test_newest_pose_wins(served: Served) -> None:
    with served.client() as client:
        client.replay()
        for mm in range(1000):
            served.scene.show(pose=make_estimate(mm))

        messages = client.until_robot_says("0.999 m")

    poses = [m for m in messages if m.get("name") == "/robot_label" and "updates" in m]
    assert len(poses) < 10


def test_path_comes_in_chunks_and_can_be_taken_away(served: Served) -> None:
    xs = np.arange(0, 6000, 10.0)
    served.scene.extend_path(xs, np.zeros(600), np.ones(600))
    drawn = replay(served)
    served.scene.reset_path()
    served.scene.extend_path([0.0, 20.0], [0.0, 0.0], [1.0, 1.0])
    again = replay(served)

    assert {n for n in names_of(drawn) if n.startswith("/trail/")} == {
        "/trail/0",
        "/trail/1",
        "/trail/2",
    }
    hidden = {
        m["name"]
        for m in again
        if m["type"] == "SetSceneNodeVisibilityMessage" and not m["visible"]
    }
    assert {"/trail/1", "/trail/2"} <= hidden
    assert "/trail/0" not in hidden


def shown_in(messages: list[dict]) -> set[str]:
    """Names of the nodes that can be seen after these messages."""
    shown = {}
    for message in messages:
        if message["type"] == "SetSceneNodeVisibilityMessage":
            shown[message["name"]] = message["visible"]
        elif message["type"] == "RemoveSceneNodeMessage":
            shown[message["name"]] = False
        elif message.get("name"):
            shown.setdefault(message["name"], True)
    return {name for name, is_shown in shown.items() if is_shown}


@pytest.mark.parametrize("shape", ["circular", "flat"])
def test_trouble_changes_the_shape_of_the_ring(socket_path: Path, serve, shape: str) -> None:
    scene = CulvertScene(make_rig(shape=shape), socket_path)
    try:
        served = serve(scene)
        rings = {}
        for mm, status in enumerate(("ok", "weak", "lost"), 9001):
            with served.client() as client:
                scene.show(pose=make_estimate(mm, status=status))
                note = "" if status == "ok" else f" · {status}"
                client.until_robot_says(f"{mm / 1000:.3f} m ± 0.01 m{note}")
            with served.client() as client:
                rings[status] = shown_in(client.replay())
    finally:
        scene.close()

    for status, nodes in rings.items():
        of_ring = {name for name in nodes if name.count("/") == 3 and "/interval/" in name}
        assert of_ring == {f"/interval/{status}/{part}" for part in ("band", "from", "to")}


PICTURES = {index: JPEG + bytes([index]) for index in range(200)}
LAYOUT = Layout(500, 1, -200, 200, 500, 1200)
"""40 such pictures are all that a browser has room for."""


def make_tiles(count: int, *, revision: int = 1, shift_m: float = 0.0) -> list[WallTile]:
    return [WallTile(k, revision, 0.5 * k + shift_m, 0.5 * (k + 1) + shift_m) for k in range(count)]


def is_tile(message: dict) -> bool:
    is_picture = message["type"] == "GlbMessage" or "glb_data" in message.get("updates", {})
    return is_picture and message["name"].startswith("/wall/")


def test_wall_is_put_where_it_was_seen(served: Served) -> None:
    served.scene.show(wall=WallPictures(make_tiles(3, shift_m=0.25), LAYOUT, PICTURES.get))
    with served.client() as client:
        tiles = client.until_all(is_tile, 3)
        place = client.until(lambda m: m["type"] == "SetPositionMessage" and m["name"] == "/wall/2")

    assert {tile["name"] for tile in tiles} == {"/wall/0", "/wall/1", "/wall/2"}
    assert tiles[2]["props"]["scale"] == [0.5, 1.0, 1.0]
    assert not tiles[2]["props"]["cast_shadow"]
    assert place[-1]["position"] == [1.25, 0.0, 0.0]


def test_only_a_changed_picture_is_sent_again(served: Served) -> None:
    reads: list[int] = []

    def read(index: int) -> bytes:
        reads.append(index)
        return PICTURES[index] + bytes([len(reads)])

    served.scene.show(wall=WallPictures(make_tiles(3), LAYOUT, read))
    replay(served)
    changed = [*make_tiles(2), WallTile(2, 2, 1.0, 1.5)]
    with served.client() as client:
        client.replay()
        served.scene.show(wall=WallPictures(changed, LAYOUT, read))
        (sent,) = client.until_all(is_tile, 1)
    served.scene.show(wall=WallPictures(changed, LAYOUT, read))
    replay(served)

    assert sent["name"] == "/wall/2"
    assert sorted(reads) == [0, 1, 2, 2]


def test_picture_that_grows_is_sent_once_a_period(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wall, "_PERIOD_S", NEVER_S)
    growing = iter(range(1, 256))

    def read(_: int) -> bytes:
        return JPEG + bytes([next(growing)])

    served.scene.show(wall=WallPictures(make_tiles(1), LAYOUT, read))
    with served.client() as client:
        client.until_all(is_tile, 1)
        for revision in range(2, 12):
            served.scene.show(wall=WallPictures(make_tiles(1, revision=revision), LAYOUT, read))
        served.scene.show(pose=make_estimate(11.0))
        meanwhile = client.until_robot_says("0.011 m")
        monkeypatch.setattr(wall, "_PERIOD_S", 0.0)
        served.scene.show(pose=make_estimate(12.0))
        client.until_all(is_tile, 1)

    assert not any(map(is_tile, meanwhile))
    assert next(growing) == 3  # of ten versions one was read


def test_corrected_distance_moves_the_wall_without_its_pictures(served: Served) -> None:
    served.scene.show(wall=WallPictures(make_tiles(2), LAYOUT, PICTURES.get))
    replay(served)
    with served.client() as client:
        client.replay()
        served.scene.show(wall=WallPictures(make_tiles(2, shift_m=0.1), LAYOUT, PICTURES.get))
        seen = client.until(lambda m: m["type"] == "SetPositionMessage" and m["name"] == "/wall/1")

    assert seen[-1]["position"] == [0.6, 0.0, 0.0]
    assert not any(map(is_tile, seen))


def test_long_wall_is_shown_around_the_robot(served: Served) -> None:
    served.scene.show(wall=WallPictures(make_tiles(200), LAYOUT, PICTURES.get))
    served.scene.show(pose=make_estimate(0.0))
    with served.client() as client:
        client.until_all(is_tile, 40)
        served.scene.show(pose=make_estimate(100_000.0))
        there = client.until_all(is_tile, 40)
        # The next pose is drawn after the last of the far pictures has been taken away.
        served.scene.show(pose=make_estimate(100_001.0))
        client.until_robot_says("100.001 m")
    with served.client() as client:
        shown = {name for name in shown_in(client.replay()) if name.startswith("/wall/")}
    assert {int(tile["name"].split("/")[2]) for tile in there} == set(range(160, 200))
    assert len(shown) == 40


def test_tile_is_a_glb_that_shows_its_picture(served: Served) -> None:
    served.scene.show(wall=WallPictures(make_tiles(1), LAYOUT, PICTURES.get))
    with served.client() as client:
        (tile,) = client.until_all(is_tile, 1)
    glb = tile["props"]["glb_data"]

    magic, version, length = (int.from_bytes(glb[i : i + 4], "little") for i in (0, 4, 8))
    assert (magic, version, length) == (0x46546C67, 2, len(glb))
    size = int.from_bytes(glb[12:16], "little")
    document, binary = json.loads(glb[20 : 20 + size]), glb[28 + size :]
    view = document["bufferViews"][document["images"][0]["bufferView"]]
    assert binary[view["byteOffset"] :][: view["byteLength"]] == PICTURES[0]


def test_selected_pin_is_marked_and_the_others_are_not(served: Served) -> None:
    pins = [Pin("a", 0.5, 6, 0.01, 5, "BAB"), Pin("b", 2, 6, 0.02, 1, "BBC")]
    served.scene.show(mode="follow")
    served.scene.show(pins=pins)
    served.scene.show(selected="b")
    marked = texts_of(replay(served))
    served.scene.show(selected=None)
    unmarked = texts_of(replay(served))

    assert {"S5 BAB\n0.50 m ± 0.01 m", "» S1 BBC\n2.00 m ± 0.02 m"} <= marked
    assert not {text for text in unmarked if "»" in text}


def test_pins_are_labelled_near_the_robot_with_a_line_to_each(served: Served) -> None:
    pins = [Pin(str(k), 0.5 * k, 3, None, None, f"P{k}.") for k in range(40)]
    served.scene.show(pins=pins)

    def named(x_m: float) -> set[str]:
        served.scene.show(pose=make_estimate(1000 * x_m))
        with served.client() as client:
            client.until_robot_says(f"{x_m:.3f} m")
        with late_joiner(served.scene) as client:
            served.scene.show(pose=make_estimate(1000 * x_m + 1))
            seen = client.replay() + client.until_robot_says(f"{x_m + 0.001:.3f} m")
        leaders = [m for m in seen if m.get("name") == "/pins/leaders" and "props" in m]
        assert len(leaders[-1]["props"]["points"]) > 0
        return {text.split(".")[0] for text in texts_of(seen) if text.startswith("P")}

    assert named(2.0) == {"P2", "P3", "P4", "P5", "P6"}
    assert named(15.0) == {"P28", "P29", "P30", "P31", "P32"}


def test_the_robot_is_hidden_from_inside_but_lights_the_pipe(served: Served) -> None:
    outside = shown_in(replay(served))
    served.scene.show(mode="inside")
    inside = shown_in(replay(served))

    assert {"/robot/body", "/robot/camera"} <= outside - inside
    assert "/robot/lamp" in inside


def test_stretches_and_sectors_are_patches_of_their_colour(served: Served) -> None:
    stretch = Pin("a", 1, 6, 0.01, 5, "BAB", finish_m=2.0)
    sector = Pin("b", 2, 10, 0.02, 1, "BBC", clock_to=2)
    served.scene.show(pins=[stretch, sector, Pin("c", 2, 10, 0.02, 3, "BBC")])
    drawn = shown_in(replay(served))
    served.scene.show(pins=[sector])
    left = shown_in(replay(served))

    assert {n for n in drawn if "/pins/patches/" in n} == {"/pins/patches/5", "/pins/patches/1"}
    assert {n for n in left if "/pins/patches/" in n} == {"/pins/patches/1"}


def test_an_hour_of_everything_is_no_more_to_keep_than_a_minute(
    served: Served, monkeypatch: pytest.MonkeyPatch, is_long: bool
) -> None:
    """As an hour of it would."""
    monkeypatch.setattr("app.viewer.scene._TICK_S", 0.0)

    def work(client: Client, steps: range) -> int:
        for step in steps:
            served.scene.extend_path([100 + 0.1 * (step % 20)], [0.1], [1.0])
            served.scene.show(preview=JPEG + bytes([step % 250]))
            served.scene.show(
                wall=WallPictures(make_tiles(10, revision=step), LAYOUT, PICTURES.get)
            )
            pins = [
                Pin(f"{step}-{k}", k, 6, 0.01, k % 6, "BAB", finish_m=k + 0.5)
                for k in range(step % 7)
            ]
            served.scene.show(pins=pins)
            served.scene.show(selected=f"{step}-1")
            status = ("ok", "weak", "lost")[step % 3]
            served.scene.show(pose=make_estimate(100.0 + step, status=status))
            client.until_robot_says(f"{(100 + step) / 1000:.3f} m")
        return kept()

    def kept() -> int:
        """What is replaced during a replay comes after it, so all that waits is drawn first."""
        with late_joiner(served.scene) as joiner:
            replayed = Counter(map(kind_of, joiner.replay()))
            served.scene.show(pose=make_estimate(90.0))
            rest = {kind_of(message) for message in joiner.until_robot_says("0.090 m")}
        return (replayed | Counter(rest)).total()

    with served.client() as client:
        client.replay()
        first = work(client, range(42))
        later = work(client, range(42, 252 if is_long else 84))

    assert later <= first


def test_pins_replace_each_other(served: Served) -> None:
    served.scene.show(mode="inside")
    served.scene.show(
        pins=[Pin("a", 0.1, 6, 0.01, 5, "BAB"), Pin("b", 0.5, None, 0.02, None, "BBC")]
    )
    both = texts_of(replay(served))
    served.scene.show(
        pins=[Pin("b", 2.5, None, 0.02, None, "BBC"), Pin("b", 0.5, 1, 0.03, 1, "BBA")]
    )
    one = texts_of(replay(served))
    served.scene.show(pins=[])
    none = texts_of(replay(served))

    assert {"S5 BAB\n0.10 m ± 0.01 m", "BBC\n0.50 m ± 0.02 m"} <= both
    assert {text for text in one if text.startswith(("BB", "S"))} == {"S1 BBA\n0.50 m ± 0.03 m"}
    assert not {text for text in none if "±" in text and "\n" in text}


def test_culvert_grows_in_whole_metres(served: Served) -> None:
    for length_mm, last in ((100, 1), (3000, 3), (3001, 4)):
        served.scene.show(length_m=length_mm / 1000)
        metres = {text for text in texts_of(replay(served)) if text.endswith(".00 m")}
        assert metres == {f"{metre}.00 m" for metre in range(last + 1)}


def test_no_joint_is_drawn_where_none_is_known(served: Served) -> None:
    messages = replay(served)
    assert not {text for text in texts_of(messages) if "joint" in text}
    assert not {"/culvert/joints", "/culvert/expected"} & names_of(messages)


def test_a_joint_that_was_expected_is_drawn_anew_when_it_is_seen(served: Served) -> None:
    served.scene.show(length_m=2)
    served.scene.show(joints=[JointMark(1, 1.5, is_seen=False)])
    before = replay(served)
    served.scene.show(joints=[JointMark(1, 1.47, is_seen=True)])
    after = replay(served)
    assert "/culvert/joints" in names_of(after) - names_of(before)
    assert "joint 1 · 1.47 m" in texts_of(after)
    assert "joint 1 · 1.50 m · expected" not in texts_of(after)


def test_floor_and_unknown_joints_are_drawn(socket_path: Path, serve) -> None:
    rig = make_rig(shape="flat", segment_length_mm=None)
    scene = CulvertScene(rig, socket_path)
    try:
        served = serve(scene)
        scene.show(pins=[Pin("a", 0.5, None, 0.01, 3, "BAF", lateral_m=0.1)])
        messages = replay(served)
    finally:
        scene.close()

    assert "1.00 m" in texts_of(messages)
    assert "/culvert/joints" not in names_of(messages)


def is_sent_to(view: View) -> Callable[[dict], bool]:
    return lambda m: is_sent(m) and m["position"] == pytest.approx(view.position.tolist())


def test_camera_moves_with_the_robot(served: Served) -> None:
    modes: tuple[CameraMode, ...] = ("follow", "inside")
    with served.client() as client:
        client.send_camera()
        for mode in modes:
            served.scene.show(mode=mode)
            for x_m in (1.0, 2.0, 0.5):
                served.scene.show(pose=make_estimate(1000 * x_m))
                view = view_of(mode, Section(0.15, 0.15), (0.0, 3.0), x_m, aspect=800 / 600)
                client.until(is_sent_to(view))


def test_no_initial_camera_overtakes_the_first_command(served: Served) -> None:
    """viser's client goes to an initial camera late, also after the command that was to last."""
    served.scene.show(mode="follow")

    messages = replay(served)

    moves = {"SetCameraPositionMessage", "SetCameraLookAtMessage", "SetCameraUpDirectionMessage"}
    assert not [m for m in messages if m["type"] in moves]


def test_overview_turned_by_hand_is_left_alone(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(views, "_SETTLED_S", 0.0)
    with served.client() as client:
        client.send_camera()
        client.until(is_sent)
        # In a low window the robot is not labelled, which shows that the camera has arrived.
        client.send_camera(position=(0.0, 1.0, -1.0), image_height=150)
        client.until(lambda m: m.get("name") == "/robot_label" and m.get("visible") is False)
        served.scene.show(length_m=5)
        served.scene.show(pose=make_estimate(7.0))
        until_pose = client.until_robot_says("0.007 m")
        served.scene.show(mode="overview")
        client.until(is_sent)

    assert not any(map(is_sent, until_pose))


def test_pictures_are_rare_for_slow_lines(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    def is_picture(message: dict) -> bool:
        return "_image_data" in message.get("updates", {})

    monkeypatch.setattr(drawing, "_PREVIEW_BYTES_PER_S", len(JPEG) / NEVER_S)
    with served.client() as client:
        client.replay()
        served.scene.show(preview=JPEG)
        client.until(is_picture)
        served.scene.show(preview=JPEG)
        meanwhile = []
        for mm in (11.0, 12.0):
            served.scene.show(pose=make_estimate(mm))
            meanwhile += client.until_robot_says(f"{mm / 1000:.3f} m")

    assert not any(map(is_picture, meanwhile))


def test_socket_is_private_and_no_port_is_opened(socket_path: Path) -> None:
    before = listeners()
    scene = CulvertScene(make_rig(), socket_path)
    try:
        assert stat.S_IMODE(socket_path.parent.stat().st_mode) == 0o700
        assert listeners() == before
    finally:
        scene.close()


def listeners() -> set[str]:
    """Inodes of this process's listening TCP sockets."""
    rows = [
        row.split()
        for family in ("tcp", "tcp6")
        for row in Path("/proc/self/net", family).read_text().splitlines()[1:]
    ]
    listening = {f"socket:[{row[9]}]" for row in rows if row[3] == "0A"}
    return listening & {str(fd.readlink()) for fd in open_files()}


def open_files() -> list[Path]:
    return [fd for fd in Path("/proc/self/fd").iterdir() if fd.is_symlink()]


def test_close_removes_the_socket_and_ends_the_view(served: Served) -> None:
    with served.client() as client:
        client.replay()
        served.scene.close()
        assert Client(client.ws).close_code() == 1013

    assert not served.scene.is_open
    assert not served.scene.socket_path.exists()


def test_ten_cycles_leave_nothing_behind(socket_path: Path) -> None:
    def cycle() -> None:
        scene = CulvertScene(make_rig(), socket_path)
        scene.show(pose=make_estimate(100.0))
        scene.close()

    cycle()
    gc.collect()
    threads, files = threading.active_count(), len(open_files())
    for _ in range(10):
        cycle()

    assert threading.active_count() <= threads
    assert len(open_files()) <= files


def test_banner_stays_off_the_terminal(socket_path: Path, capfd: pytest.CaptureFixture) -> None:
    CulvertScene(make_rig(), socket_path).close()

    assert capfd.readouterr().out == ""


def test_writing_from_a_thread_leaves_the_waiters_to_the_loop() -> None:
    """asyncio's own event would walk through them there: "deque mutated during iteration"."""

    async def wait_and_write() -> list[bool]:
        loop = asyncio.get_running_loop()
        buffer = AsyncMessageBuffer(loop, persistent_messages=False)
        waiting = asyncio.create_task(buffer.message_event.wait())
        await asyncio.sleep(0)
        with buffer.sanctioned_dead_writes():
            buffer.atomic_start()
            await asyncio.to_thread(buffer.push, RunJavascriptMessage(source=""))
            await asyncio.sleep(0)
            woken = [waiting.done(), buffer.message_event.is_set()]
            await asyncio.to_thread(buffer.atomic_end)
        return [*woken, await asyncio.wait_for(waiting, 5)]

    # In a thread of its own: Playwright keeps a loop running in the one of the tests.
    with ThreadPoolExecutor(1) as thread:
        states = thread.submit(asyncio.run, wait_and_write()).result()
    assert states == [False, True, True]


def test_socket_left_by_a_crash_is_replaced(socket_path: Path) -> None:
    socket_path.parent.mkdir(parents=True)
    socket_path.touch()
    scene = CulvertScene(make_rig(), socket_path)
    assert scene.is_open
    scene.close()


def test_place_that_cannot_hold_a_socket_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for folder, said in (("x" * 120, "longer than 107 bytes"), ("file", "cannot make its socket")):
        with pytest.raises(ViewerUnavailable, match=said):
            start_private_server(tmp_path / folder / "a.sock")


def test_start_that_takes_too_long_is_an_error(
    socket_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start, may_start = viser.ViserServer, threading.Event()

    def start_late(**options: object) -> viser.ViserServer:
        may_start.wait(PATIENCE_S)
        return start(**options)

    monkeypatch.setattr("app.viewer.private_server.START_LIMIT_S", 0.0)
    monkeypatch.setattr(viser, "ViserServer", start_late)
    with pytest.raises(ViewerUnavailable, match="did not start within"):
        start_private_server(socket_path)
    may_start.set()
    wait_until(lambda: not any(one.name == "viser-start" for one in threading.enumerate()))

    assert not socket_path.exists()


def test_other_websockets_are_left_alone_once_the_view_has_started(served: Served) -> None:
    assert served.scene.is_open
    assert websockets.asyncio.server.serve.__module__ == "websockets.asyncio.server"
