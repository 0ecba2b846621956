"""The unrolled wall, the health of the pictures and the joints, from the tracking to the API."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders import PATIENCE_S, STEP_MM, Client, assert_error
from films import half_sized

from app.jobs.track.batches import WallPicture
from app.lab.simulation import SCENARIOS
from app.lab.simulation.write import simulate
from app.storage.blobs.folder import FolderBlobs
from app.tracking.live import Live, WallChanged
from app.tracking.tracks import HealthColumns, Tracks
from app.tracking.unrolled import Unrolled
from vo_core.image.health import Health, complaints
from vo_core.mosaic.layout import Layout


def unrolled(client: Client, inspection_id: str) -> dict:
    answer = client.get(f"/api/inspections/{inspection_id}/unrolled")
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_wall_is_there_in_tiles_when_tracking_is_done(shared: Client, done: str) -> None:
    wall = unrolled(shared, done)
    tiles = wall.pop("tiles")
    assert wall["tile_m"] == 0.5
    assert wall["width_px"] * wall["mm_per_px"] == pytest.approx(500)
    assert wall["arc_from_mm"] < 0 < wall["arc_to_mm"]
    assert [tile["index"] for tile in tiles] == [-1, 0]
    assert (tiles[1]["from_m"], tiles[1]["to_m"]) == (0.0, 0.5)
    for tile in tiles:
        path = f"/api/inspections/{done}/unrolled/{tile['index']}.jpg"
        answer = shared.get(path, params={"v": tile["revision"]})
        assert answer.headers["Content-Type"] == "image/jpeg"
        assert answer.headers["Cache-Control"] == "private, no-cache"
        known = {"If-None-Match": answer.headers["ETag"]}
        assert shared.get(path, headers=known).status_code == 304
        picture = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
        assert picture.shape == (wall["height_px"], wall["width_px"], 3)
        assert picture.std() > 5


def test_what_was_not_seen_is_not_there(shared: Client, done: str) -> None:
    answer = shared.get(f"/api/inspections/{done}/unrolled/7.jpg")
    assert "7" in assert_error(answer, 404, "tile_not_found")
    nobody = "0" * 32
    for path in ("unrolled", "unrolled/0.jpg", "health"):
        answer = shared.get(f"/api/inspections/{nobody}/{path}")
        assert_error(answer, 404, "inspection_not_found")


def test_tiles_follow_a_correction(shared: Client, own: str) -> None:
    before = unrolled(shared, own)["tiles"]
    stated = {"zero": {"frame": 0, "offset_m": 1.25}, "remark": None}
    answer = shared.put(f"/api/inspections/{own}/corrections", json=stated)
    assert answer.status_code == 200, answer.text
    after = unrolled(shared, own)["tiles"]
    moved = [new["from_m"] - old["from_m"] for new, old in zip(after, before, strict=True)]
    assert moved == pytest.approx([1.25, 1.25], abs=1e-3)
    assert [tile["revision"] for tile in after] == [tile["revision"] for tile in before]


def runs_of(client: Client, path: str) -> set[str]:
    """The runs that the columns of the track and of the health are of, one of both."""
    answers = [client.get(f"{path}/{name}?format=columns") for name in ("track", "health")]
    runs = {json.loads(answer.content.partition(b"\n")[0])["run"] for answer in answers}
    assert len(runs) == 1
    return runs


def test_a_second_run_begins_the_wall_anew_and_who_watches_hears_of_its_end(
    shared: Client, own: str
) -> None:
    before = {tile["index"]: tile["revision"] for tile in unrolled(shared, own)["tiles"]}
    path = f"/api/inspections/{own}"
    of_first = runs_of(shared, path)
    stale = shared.data / "inspections" / own / "wall" / "40.jpg"
    stale.write_bytes(b"of the run before")
    heard = []
    with (
        shared.server.app.state.services[Live].listening(own, heard.append),
        shared.socket(f"{path}/live") as socket,
    ):
        shared.post(f"{path}/retry")
        states = []
        while states[-1:] != ["done"] or len(set(states)) == 1:
            message = socket.recv(PATIENCE_S)
            header = json.loads(message[4 : 4 + int.from_bytes(message[:4], "big")])
            socket.send(json.dumps({"type": "ack", "seq": header["seq"]}))
            states.append(header["state"])
        assert header["progress"]["frames_done"] == 40
        shared.wait(own, "done")
    after = {tile["index"]: tile["revision"] for tile in unrolled(shared, own)["tiles"]}
    assert of_first.isdisjoint(runs_of(shared, path)), "what is read names its run"
    assert after.keys() == before.keys()
    assert all(after[index] > before[index] for index in after)
    published = [event for event in heard if isinstance(event, WallChanged)]
    assert {index for event in published for index in event.indices} == set(after)


def test_health_has_a_row_for_every_frame_and_outlives_a_restart(shared: Client, done: str) -> None:
    columns = shared.get(f"/api/inspections/{done}/health").json()["columns"]
    numbers = ["overlap", "brightness", "overexposed", "sharpness", "fixed_pattern"]
    assert list(columns) == [*numbers, "complaints"]
    assert {len(column) for column in columns.values()} == {40}
    assert columns["overlap"][0] == 1
    assert columns["overlap"][20] == pytest.approx(1 - STEP_MM / 205, abs=0.005)
    assert all(0 <= value <= 1 for name in numbers for value in columns[name])
    later = shared.get(f"/api/inspections/{done}/health", params={"since": 30}).json()["columns"]
    assert later["brightness"] == columns["brightness"][30:]
    file = shared.data / "inspections" / done / "health.csv"
    assert file.read_text().splitlines()[0] == "frame," + ",".join(numbers)
    read = HealthColumns.from_csv(file.read_text()).columns()
    rows = zip(*(column.tolist() for column in read.values()), strict=True)
    assert [" ".join(complaints(Health(*row))) for row in rows] == columns["complaints"]


def test_joints_are_found_while_tracking(shared: Client, tmp_path: Path) -> None:
    scenario = half_sized(replace(SCENARIOS["nominal"].shortened(250), first_joint_mm=150.0))
    video = simulate(scenario, tmp_path).video
    inspection_id = shared.inspect(video, rig=scenario.rig.model_dump(mode="json"))
    assert shared.wait(inspection_id)["status"] == "done"
    tracks = shared.server.app.state.services[Tracks]
    (sighting,) = tracks.sightings(inspection_id)
    track = tracks.get(inspection_id)
    assert track.distance_mm[sighting.frame] + sighting.ahead_mm == pytest.approx(150, abs=2)
    assert (shared.data / "inspections" / inspection_id / "joints.csv").exists()


def test_a_tile_that_cannot_be_written_waits_for_the_next_one(tmp_path: Path) -> None:
    live, heard = Live(), []
    walls, in_the_way = Unrolled(FolderBlobs(tmp_path), live), tmp_path / "inspections"
    in_the_way.write_bytes(b"a file where a folder should be")
    with live.listening(None, heard.append):
        walls.take("a", [WallPicture(0, b"older"), WallPicture(1, b"other")])
        walls.take("a", [WallPicture(0, b"newer")])
        assert heard == []
        in_the_way.unlink()
        walls.take("a", [WallPicture(2, b"next")])
    assert [event.indices for event in heard] == [(0, 1, 2)]
    assert [walls.picture("a", n) for n in range(3)] == [b"newer", b"other", b"next"]


def test_a_deleted_inspection_gets_no_more_tiles(tmp_path: Path) -> None:
    walls = Unrolled(FolderBlobs(tmp_path), Live())
    walls.refuse("a")
    walls.take("a", [WallPicture(0, b"jpeg")])
    assert walls.tiles("a") == []
    walls.end("a")
    walls.take("a", [WallPicture(0, b"jpeg")])
    assert len(walls.tiles("a")) == 1


def test_the_layout_is_that_of_the_rig(shared: Client, done: str) -> None:
    services = shared.server.app.state.services
    rig = SCENARIOS["forward_wide"].rig
    assert services[Unrolled].layout(rig) == Layout.of(rig)
