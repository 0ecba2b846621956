"""Live inspections through the server: from a camera on loopback to a video fit for review."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from builders import (
    PATIENCE_S,
    Client,
    assert_error,
    children,
    clip_rig,
    frame_number,
    send_signal,
    serving,
    wait_until,
)
from cameras import Camera, MjpegCamera, RtspCamera
from processes import process
from surveys import Survey
from websockets.sync.client import ClientConnection

from vo_core.sources import VideoFile

CAMERA = "app.jobs.live.camera"
LOOPBACK = ("127.0.0.0/8",)
OPEN = "6f1c2a34-0000-4000-8000-00000000000c"


@pytest.fixture(scope="module")
def field(survey: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A server that may open cameras on loopback and files in a folder."""
    data = survey.copied_to(tmp_path_factory.mktemp("field") / "data")
    watch = data.with_name("watch")
    watch.mkdir()
    with serving(data, camera_networks=LOOPBACK, watch_folder=watch) as client:
        yield client


def recorded(client: Client, camera: Camera, frames: int = 15) -> str:
    """A live inspection that has so many frames."""
    inspection_id = client.record(camera.url)
    wait_until(lambda: client.frames_done(inspection_id) >= frames)
    return inspection_id


def finish(client: Client, inspection_id: str, **fields: Any) -> httpx.Response:
    return client.post(
        f"/api/inspections/{inspection_id}/finish", json={"end_condition": "complete"} | fields
    )


def finished(client: Client, inspection_id: str, **fields: Any) -> dict[str, Any]:
    """Finish it, which answers at once, and wait for what is made of it."""
    answer = finish(client, inspection_id, **fields)
    assert answer.status_code == 200, answer.text
    live = answer.json()["live"]
    assert live is None or live["is_ending"]
    return client.wait(inspection_id)


def assert_track_is_recording(client: Client, inspection_id: str) -> list[float]:
    """Row i is frame i of the video; the times."""
    answer = client.get(f"/api/inspections/{inspection_id}/track?format=json&raw=true")
    columns = answer.json()["columns"]
    folder = client.data / "inspections" / inspection_id
    # What the video was made of goes as soon as nobody reads it more, after the last row.
    wait_until(lambda: len(files_of(folder)) == 1)
    with VideoFile(*files_of(folder)) as video:
        times = [frame.t_s for frame in video]
    assert columns["frame"] == list(range(len(times)))
    assert np.allclose(columns["time_s"], times, atol=1e-6)
    return times


def files_of(folder: Path) -> list[Path]:
    return [*folder.glob("video.*"), *folder.glob("recording.mkv")]


def receive(socket: ClientConnection) -> tuple[dict[str, Any], bytes]:
    message = socket.recv(PATIENCE_S)
    assert isinstance(message, bytes)
    length = int.from_bytes(message[:4], "big")
    header = json.loads(message[4 : 4 + length])
    socket.send(json.dumps({"type": "ack", "seq": header["seq"]}))
    return header, message[4 + length :]


def test_a_camera_that_drops_out_and_whose_process_is_killed_becomes_one_inspection(
    field: Client,
) -> None:
    with RtspCamera() as camera:
        inspection_id = recorded(field, camera)
        assert field.inspection(inspection_id)["live"]["connected"]
        camera.drop_out()
        wait_until(lambda: not field.inspection(inspection_id)["live"]["connected"])
        assert field.inspection(inspection_id)["live"]["detail"]
        camera.come_back()
        before = field.frames_done(inspection_id)
        wait_until(lambda: field.frames_done(inspection_id) >= before + 15)
        (first,) = children(CAMERA)
        send_signal(CAMERA, signal.SIGKILL)
        before = field.frames_done(inspection_id)
        wait_until(lambda: field.frames_done(inspection_id) >= before + 15)
        assert children(CAMERA) != [first]
        live = field.inspection(inspection_id)["live"]
        assert live["reconnects"] >= 2
        assert live["recorded_s"] > 1.0
        done = finished(field, inspection_id, known_length_m=12.5)
    assert (done["status"], done["error"], done["live"]) == ("done", None, None)
    assert done["header"] == {"end_condition": "complete", "known_length_m": 12.5}
    assert (done["video"]["codec"], done["video"]["playable"]) == ("h264", True)
    assert done["source"]["kind"] == "live"
    assert done["source"]["size"] > 10_000
    assert len(done["source"]["sha256"]) == 64
    times = assert_track_is_recording(field, inspection_id)
    assert done["progress"]["frames_done"] == len(times)
    assert done["video"]["duration_s"] == pytest.approx(times[-1], abs=0.1)
    picture = field.get(f"/api/inspections/{inspection_id}/frames/20.jpg")
    numbers = [
        frame_number(field.get(f"/api/inspections/{inspection_id}/frames/{n}.jpg").content)
        for n in (20, 21)
    ]
    assert picture.status_code == 200
    assert numbers[0] < numbers[1]
    video = field.get(f"/api/inspections/{inspection_id}/video")
    assert len(video.content) == done["source"]["size"]
    assert not children(CAMERA)


@pytest.mark.usefixtures("photos_are_waited_for")
def test_each_message_shows_one_frame_with_its_age_and_a_tag_has_its_photo_at_once(
    field: Client,
) -> None:
    with MjpegCamera() as camera:
        began_s = time.monotonic()
        inspection_id = field.record(camera.url)
        shown = {}
        with field.socket(f"/api/inspections/{inspection_id}/live") as socket:
            while len(shown) < 20:
                header, jpeg = receive(socket)
                if jpeg:
                    shown[header["frame"]] = frame_number(jpeg)
                    assert header["camera"] == "connected"
                    assert 0 <= header["age_ms"] < 1000 * (time.monotonic() - began_s)
                    assert header["dropped"] >= 0
                    assert header["revision"] == 0
                    assert header["distance_raw_mm"] == header["distance_mm"]
            tag = field.tag(inspection_id, frame=header["frame"]).json()
            assert tag["photo"], tag["photo_error"]
            assert frame_number(field.get(tag["photo"]).content) == shown[header["frame"]]
            camera.drop_out()
            while header["camera"] == "connected" or jpeg:  # one picture may still be on its way
                header, jpeg = receive(socket)
            assert header["camera"] == "reconnecting"
            assert header["frame"] is not None, "the last pose stays"
            field.post(f"/api/inspections/{inspection_id}/cancel")
            while header["state"] == "running":
                header, _ = receive(socket)
    assert header["state"] == "cancelled"
    cancelled = field.inspection(inspection_id)
    assert (cancelled["status"], cancelled["live"]) == ("cancelled", None)
    assert len(assert_track_is_recording(field, inspection_id)) >= 20


def test_a_killed_server_leaves_a_recording_that_the_next_one_tracks(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with RtspCamera() as camera, process(data, CAMERA_NETWORKS=LOOPBACK[0]) as client:
        inspection_id = recorded(client, camera, 21)
        client.tag(inspection_id, frame=18)
    with serving(data) as client:
        done = client.wait(inspection_id)
        assert done["status"] == "done", done
        assert "server ended during the recording" in done["warning"]
        assert done["video"]["playable"]
        assert len(assert_track_is_recording(client, inspection_id)) > 20
        (tag,) = client.get(f"/api/inspections/{inspection_id}/observations").json()["observations"]
        assert tag["frame"] == 18
        assert tag["distance_m"] > 0


def test_a_past_video_answers_a_ping_has_an_end_in_the_audit_and_is_not_gone_on_with(
    field: Client, done: str
) -> None:
    with field.socket(f"/api/inspections/{done}/live") as socket:
        header, _ = receive(socket)
        assert (header["age_ms"], header["camera"], header["dropped"]) == (None, None, 0)
        socket.send(json.dumps({"type": "ping", "t": 12.5}))
        assert json.loads(socket.recv(PATIENCE_S)) == {"type": "pong", "t": 12.5}
    stated = {"url": "http://127.0.0.1:9/", "robot": "moved"}
    goes_on = field.post(f"/api/inspections/{done}/continue", json=stated)
    assert_error(goes_on, 409, "nothing_recorded")
    refused = finish(field, done, end_condition="abandoned")
    assert "reason" in assert_error(refused, 422, "invalid_request")
    assert finish(field, done).json()["header"]["end_condition"] == "complete"
    events = field.get(f"/api/inspections/{done}/events").json()["events"]
    assert events[0]["action"] == "finished"
    assert events[0]["after"]["header"]["end_condition"] == "complete"


def test_a_source_that_is_refused_makes_no_inspection(field: Client) -> None:
    before = len(field.get("/api/inspections").json()["inspections"])
    source = {"kind": "live", "url": "rtsp://user:s3cret@8.8.8.8/x"}
    body = {"name": "Culvert 7", "source": source, "rig": clip_rig()}
    answer = field.post("/api/inspections", json=body)
    detail = assert_error(answer, 422, "live_source_refused")
    assert "s3cret" not in detail
    assert len(field.get("/api/inspections").json()["inspections"]) == before


def test_a_camera_of_another_size_fails_at_once_and_has_nothing_to_retry(field: Client) -> None:
    with MjpegCamera(size_wh=(320, 240)) as camera:
        failed = field.wait(field.record(camera.url))
    assert (failed["status"], failed["error"]["code"]) == ("failed", "rig_video_mismatch")
    retry = field.post(f"/api/inspections/{failed['id']}/retry")
    assert_error(retry, 409, "nothing_recorded")


def test_what_has_no_picture_is_no_inspection_and_a_deletion_ends_a_recording(
    field: Client,
) -> None:
    with MjpegCamera() as camera:
        camera.drop_out()
        inspection_id = field.record(camera.url)
        wait_until(lambda: field.inspection(inspection_id)["live"]["detail"])
        ended = finished(field, inspection_id)
        assert (ended["status"], ended["error"]["code"]) == ("failed", "nothing_recorded")
        camera.come_back()
        inspection_id = recorded(field, camera, 1)
        assert field.delete(f"/api/inspections/{inspection_id}").status_code == 204
    assert not children(CAMERA)
    assert not (field.data / "inspections" / inspection_id).exists()


def test_a_recorders_file_is_offered_and_ends_by_itself(
    field: Client, tmp_path: Path, clip: Path
) -> None:
    assert field.get("/api/sources").json()["sources"] == []
    (field.data.with_name("watch") / "run 4.mkv").write_bytes(_as_mkv(clip, tmp_path / "run.mkv"))
    (offered,) = field.get("/api/sources").json()["sources"]
    assert offered == {"url": "file:run 4.mkv", "kind": "folder", "name": "run 4.mkv"}
    inspection_id = field.record(offered["url"])
    assert field.inspection(inspection_id)["source"]["filename"] == "run 4.mkv"
    done = field.wait(inspection_id)
    assert (done["status"], done["progress"]["frames_done"]) == ("done", 40)
    assert done["live"] is None
    assert_track_is_recording(field, inspection_id)


def _as_mkv(clip: Path, path: Path) -> bytes:
    import av

    with av.open(str(clip)) as source, av.open(str(path), "w") as sink:
        stream = source.streams.video[0]
        copy = sink.add_stream_from_template(stream)
        for packet in source.demux(stream):
            if packet.size:
                packet.stream = copy
                sink.mux(packet)
    return path.read_bytes()


def test_a_stopped_recording_goes_on_as_the_next_part(field: Client) -> None:
    with RtspCamera() as camera:
        inspection_id = recorded(field, camera)
        path = f"/api/inspections/{inspection_id}"
        field.tag(inspection_id, "6f1c2a34-0000-4000-8000-00000000000a", frame=8)
        assert_error(field.put(f"{path}/rig", json={"rig": clip_rig()}), 409, "still_running")
        field.tag(inspection_id, OPEN, frame=3, code="BAF", continuous="A2")
        assert "A2" in assert_error(finish(field, inspection_id), 409, "open_stretches")
        assert field.inspection(inspection_id)["status"] == "running"
        field.delete(f"{path}/observations/{OPEN}")
        how = {"end_condition": "abandoned", "abandon_reason": "Roots."}
        first = finished(field, inspection_id, **how)
        assert first["header"]["abandon_reason"] == "Roots."
        part_at = first["progress"]["frames_done"]
        before = field.get(f"{path}/track?format=json&raw=true").json()["columns"]
        picture = field.get(f"{path}/frames/8.jpg").content
        stated = {"url": camera.url, "robot": "stood_still"}
        going_on = field.post(f"{path}/continue", json=stated)
        assert going_on.status_code == 200, going_on.text
        assert going_on.json()["status"] == "running"
        assert "end_condition" not in going_on.json()["header"]
        assert_error(field.post(f"{path}/continue", json=stated), 409, "still_running")
        wait_until(lambda: field.frames_done(inspection_id) >= part_at + 15)
        assert field.get(f"{path}/frames/8.jpg").content
        done = finished(field, inspection_id)
    assert (done["status"], done["error"]) == ("done", None)
    times = assert_track_is_recording(field, inspection_id)
    assert times[part_at] - times[part_at - 1] == pytest.approx(1, abs=0.2)
    after = field.get(f"{path}/track?format=json&raw=true").json()["columns"]
    assert after["distance_mm"][:part_at] == pytest.approx(before["distance_mm"], abs=0.01)
    assert frame_number(field.get(f"{path}/frames/8.jpg").content) == pytest.approx(
        frame_number(picture)
    )
    assert after["distance_mm"][part_at] == pytest.approx(before["distance_mm"][-1], abs=0.01)
    growth_mm = after["sigma_distance_mm"][part_at] - before["sigma_distance_mm"][-1]
    assert growth_mm < 5
    events = field.get(f"{path}/events").json()["events"]
    assert [event["action"] for event in events[:2]] == ["finished", "continued"]
    assert events[1]["after"]["robot"] == "stood_still"
    # Tracked again from the film, with another rig, each part goes on as it did.
    (tag,) = field.get(f"{path}/observations").json()["observations"]
    rig = clip_rig()
    rig["camera"] |= {"fx": 2 * rig["camera"]["fx"], "fy": 2 * rig["camera"]["fy"]}
    misfit = field.put(f"{path}/rig", json={"rig": clip_rig(width=320)})
    assert_error(misfit, 422, "rig_video_mismatch")
    assert field.put(f"{path}/rig", json={"rig": rig}).json()["status"] in ("queued", "running")
    ended = field.wait(inspection_id)
    assert (ended["status"], ended["rig"]["camera"]["fx"]) == ("done", rig["camera"]["fx"])
    assert ended["progress"]["frames_done"] == len(times)
    again = field.get(f"{path}/track?format=json&raw=true").json()["columns"]
    error_mm = again["distance_mm"][part_at] - again["distance_mm"][part_at - 1]
    assert abs(error_mm) < 0.01
    (same,) = field.get(f"{path}/observations").json()["observations"]
    assert (same["frame"], same["photo"]) == (8, tag["photo"])
    assert abs(same["distance_m"] - tag["distance_m"] / 2) < 0.01
    event = field.get(f"{path}/events").json()["events"][0]
    assert event["action"] == "rig_changed"
    assert event["after"] == {name: rig["camera"][name[7:]] for name in ("camera.fx", "camera.fy")}
