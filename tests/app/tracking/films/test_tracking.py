"""Films that are tracked, wait, are stopped and begin again, on real servers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from builders import Client, assert_error, children, clip_rig, make_clip, serving, wait_until

TRACKER = "app.jobs.track.tracker"
FRAMES, PACE = 150, 0.25
"""A film that takes 24 s, so that it is still on its way when a slow test looks."""


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_clip(tmp_path_factory.mktemp("film") / "film.mp4", FRAMES)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_clip(tmp_path_factory.mktemp("film") / "short.mp4", 10)


@pytest.fixture(scope="module")
def paced(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with (
        pytest.MonkeyPatch.context() as patch,
        serving(tmp_path_factory.mktemp("paced"), pace=PACE) as client,
    ):
        patch.setenv("CHAINAGE_TOKEN", "secret-of-the-server")
        yield client


def running(client: Client, video: Path) -> str:
    """An inspection in mid-track."""
    inspection_id = client.inspect(video)
    wait_until(lambda: client.frames_done(inspection_id) > 3)
    return inspection_id


def columns(client: Client, inspection_id: str) -> dict[str, list[float]]:
    track = client.get(f"/api/inspections/{inspection_id}/track?format=json")
    return dict(track.json()["columns"])


def test_a_confined_run_shows_its_progress_until_it_is_cancelled_and_begins_again(
    paced: Client, film: Path
) -> None:
    inspection_id = running(paced, film)
    path = f"/api/inspections/{inspection_id}"
    first = paced.inspection(inspection_id)
    wait_until(lambda: paced.frames_done(inspection_id) > first["progress"]["frames_done"])
    now = paced.inspection(inspection_id)
    assert now["status"] == "running"
    assert now["progress"]["frames_total"] == FRAMES
    assert now["progress"]["fps"] > 0
    assert now["progress"]["eta_s"] > 0
    assert now["distance_m"] > first["distance_m"] > 0
    assert len(columns(paced, inspection_id)["frame"]) >= now["progress"]["frames_done"]
    assert_error(paced.post(f"{path}/retry"), 409, "still_running")
    assert_knows_no_secret_and_can_write_nothing(*children(TRACKER))

    cancelled = paced.post(f"{path}/cancel").json()
    assert (cancelled["status"], cancelled["error"]) == ("cancelled", None)
    assert not children(TRACKER)
    assert len(columns(paced, inspection_id)["frame"]) == cancelled["progress"]["frames_done"] > 3
    assert paced.post(f"{path}/cancel").json()["status"] == "cancelled"

    again = paced.post(f"{path}/retry").json()
    assert again["status"] in ("queued", "running")
    assert again["error"] is None
    wait_until(lambda: paced.frames_done(inspection_id) > 3)
    paced.post(f"{path}/cancel")


def assert_knows_no_secret_and_can_write_nothing(pid: int) -> None:
    assert b"secret" not in Path(f"/proc/{pid}/environ").read_bytes()
    limits = {
        line[:26].strip(): line[26:].split()[0]
        for line in Path(f"/proc/{pid}/limits").read_text().splitlines()[1:]
    }
    assert limits["Max file size"] == "0"
    assert limits["Max core file size"] == "0"
    assert limits["Max address space"] == str(1536 * 2**20)
    assert limits["Max cpu time"] == str(24 * 3600)


def test_inspections_wait_for_their_turn_and_one_may_be_cancelled_or_lost_meanwhile(
    paced: Client, film: Path, short: Path
) -> None:
    first = running(paced, film)
    rig = clip_rig()
    rig["mount"]["height_mm"] = 400.0
    second, lost, last = (paced.inspect(short, rig=rig) for _ in range(3))
    assert paced.inspection(last)["status"] == "queued"
    assert paced.post(f"/api/inspections/{second}/cancel").json()["status"] == "cancelled"
    (paced.data / "inspections" / lost / "video.mp4").unlink()
    paced.post(f"/api/inspections/{first}/cancel").raise_for_status()
    failed = paced.wait(lost)
    assert (failed["status"], failed["error"]["code"]) == ("failed", "blob_not_found")
    assert "video.mp4" in failed["error"]["detail"]
    done = paced.wait(last)
    assert done["status"] == "done"
    assert done["distance_m"] == pytest.approx(2 * 9 * 1.6 / 1000, rel=0.01), "by its own rig"
    assert paced.inspection(second)["status"] == "cancelled"
    assert_error(paced.post(f"/api/inspections/{last}/cancel"), 409, "not_running")


def test_two_slots_track_two_films_at_a_time_and_all_goes_on_after_a_restart(
    tmp_path: Path, film: Path, short: Path
) -> None:
    with serving(tmp_path, max_jobs=2, pace=PACE) as client:
        both = [client.inspect(film) for _ in range(2)]
        wait_until(lambda: all(client.frames_done(each) > 0 for each in both))
        assert len(children(TRACKER)) == 2
        waiting = client.inspect(short)
    assert not children(TRACKER)
    with serving(tmp_path, max_jobs=2, pace=PACE) as client:
        for each in both:
            client.wait(each, "running")
        assert client.inspection(waiting)["status"] == "queued"
        for each in both:
            client.post(f"/api/inspections/{each}/cancel")
        assert client.wait(waiting)["status"] == "done"
