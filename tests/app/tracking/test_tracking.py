import threading
from pathlib import Path

import pytest
from builders import (
    Client,
    children,
    clip_rig,
    make_clip,
    serving,
    wait_until,
)

TRACKER = "app.jobs.tracker"


def frames_done(client: Client, inspection_id: str) -> int:
    return int(client.inspection(inspection_id)["progress"]["frames_done"])


def running(client: Client, video: Path) -> str:
    """An inspection in mid-track."""
    inspection_id = client.inspect(video)
    wait_until(lambda: frames_done(client, inspection_id) > 30)
    return inspection_id


def test_progress_rises_with_speed_and_time_left(server: Client, long_clip: Path) -> None:
    inspection_id = running(server, long_clip)
    first = server.inspection(inspection_id)
    wait_until(lambda: frames_done(server, inspection_id) > first["progress"]["frames_done"])
    now = server.inspection(inspection_id)
    assert now["status"] == "running"
    assert now["progress"]["frames_total"] == 1500
    assert now["progress"]["fps"] > 5
    assert now["progress"]["eta_s"] > 0
    assert now["distance_m"] > first["distance_m"] > 0
    track = server.get(f"/api/inspections/{inspection_id}/track?format=json").json()
    assert len(track["columns"]["frame"]) >= now["progress"]["frames_done"]


def test_cancel_stops_at_once_and_keeps_the_track(server: Client, long_clip: Path) -> None:
    inspection_id = running(server, long_clip)
    cancelled = server.post(f"/api/inspections/{inspection_id}/cancel").json()
    assert cancelled["status"] == "cancelled"
    assert cancelled["error"] is None
    assert not children(TRACKER)
    track = server.get(f"/api/inspections/{inspection_id}/track?format=json").json()
    assert len(track["columns"]["frame"]) == cancelled["progress"]["frames_done"] > 30
    again = server.post(f"/api/inspections/{inspection_id}/cancel")
    assert again.json()["status"] == "cancelled"


def test_what_is_done_cannot_be_cancelled(shared: Client, done: str) -> None:
    answer = shared.post(f"/api/inspections/{done}/cancel")
    assert (answer.status_code, answer.json()["code"]) == (409, "not_running")


def test_retry_tracks_again_from_the_start(server: Client, clip: Path, long_clip: Path) -> None:
    inspection_id = running(server, long_clip)
    refused = server.post(f"/api/inspections/{inspection_id}/retry")
    assert (refused.status_code, refused.json()["code"]) == (409, "still_running")
    server.post(f"/api/inspections/{inspection_id}/cancel")
    again = server.post(f"/api/inspections/{inspection_id}/retry").json()
    assert again["status"] in ("queued", "running")
    assert again["error"] is None
    wait_until(lambda: frames_done(server, inspection_id) > 30)


def test_inspections_wait_for_their_turn(server: Client, clip: Path, long_clip: Path) -> None:
    first = running(server, long_clip)
    second, third = server.inspect(clip), server.inspect(clip)
    assert server.inspection(second)["status"] == "queued"
    assert server.post(f"/api/inspections/{second}/cancel").json()["status"] == "cancelled"
    server.post(f"/api/inspections/{first}/cancel")
    assert server.wait(third)["status"] == "done"
    assert server.inspection(second)["status"] == "cancelled"


def test_a_film_that_is_lost_while_it_waits_is_a_failure(
    server: Client, clip: Path, long_clip: Path
) -> None:
    first, second = running(server, long_clip), server.inspect(clip)
    (server.data / "inspections" / second / "video.mp4").unlink()
    server.post(f"/api/inspections/{first}/cancel").raise_for_status()
    failed = server.wait(second)
    assert (failed["status"], failed["error"]["code"]) == ("failed", "blob_not_found")
    assert "video.mp4" in failed["error"]["detail"]


def test_two_slots_track_two_videos_at_a_time(tmp_path: Path, long_clip: Path) -> None:
    with serving(tmp_path, max_jobs=2) as client:
        both = [client.inspect(long_clip), client.inspect(long_clip)]
        wait_until(lambda: all(frames_done(client, each) > 0 for each in both))
        assert len(children(TRACKER)) == 2


def test_what_was_running_and_queued_goes_on_after_a_restart(
    tmp_path: Path, clip: Path, long_clip: Path
) -> None:
    with serving(tmp_path) as client:
        first, second = running(client, long_clip), client.inspect(clip)
    assert not children(TRACKER)
    with serving(tmp_path) as client:
        client.wait(first, "running")
        assert client.inspection(second)["status"] == "queued"
        wait_until(lambda: frames_done(client, first) > 30)
        client.post(f"/api/inspections/{first}/cancel")
        assert client.wait(second)["status"] == "done"


def test_a_truncated_video_is_tracked_as_far_as_it_is(server: Client, tmp_path: Path) -> None:
    whole = make_clip(tmp_path / "whole.mkv", 100).read_bytes()
    cut = tmp_path / "cut.mkv"
    cut.write_bytes(whole[: len(whole) // 2])
    inspection_id = server.inspect(cut)
    ended = server.wait(inspection_id)
    assert ended["status"] == "done"
    assert 10 < ended["progress"]["frames_done"] < 90
    assert "ends at" in ended["warning"]
    assert ended["warning"].endswith(".")


def test_the_child_knows_no_secret_and_can_write_nothing(
    server: Client, long_clip: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHAINAGE_TOKEN", "secret-of-the-server")
    running(server, long_clip)
    (pid,) = children(TRACKER)
    assert b"secret" not in Path(f"/proc/{pid}/environ").read_bytes()
    limits = {
        line[:26].strip(): line[26:].split()[0]
        for line in Path(f"/proc/{pid}/limits").read_text().splitlines()[1:]
    }
    assert limits["Max file size"] == "0"
    assert limits["Max core file size"] == "0"
    assert limits["Max address space"] == str(1536 * 2**20)
    assert limits["Max cpu time"] == str(24 * 3600)


def test_tracking_does_not_wait_for_requests(server: Client, long_clip: Path) -> None:
    inspection_id = running(server, long_clip)
    ended = threading.Event()

    def ask() -> None:
        with server.anonymous() as other:
            while not ended.is_set():
                other.get("/healthz")

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    before = frames_done(server, inspection_id)
    wait_until(lambda: frames_done(server, inspection_id) > before + 60)
    ended.set()
    for thread in threads:
        thread.join()


def test_the_rig_is_used(server: Client, clip: Path) -> None:
    rig = clip_rig()
    rig["mount"]["height_mm"] = 400.0
    ended = server.wait(server.inspect(clip, rig=rig))
    assert ended["distance_m"] == pytest.approx(2 * 39 * 1.6 / 1000, rel=0.01)
