"""The burnt-in counter of an inspection: read after the tracking, compared, stated by people."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import counter_drives
import numpy as np
import pytest
from builders import Client, assert_error, make_clip, serving, wait_until
from counter_drives import STEP_MM, CounterDrive
from counter_surveys import DRIVE, counter, faulty_drive, inspect, settled
from surveys import Survey, served

TICK_MM = 10.0


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("drives")


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Survey:
    return faulty_drive(tmp_path_factory)


@pytest.fixture(scope="module")
def desk(survey: Survey, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with served(survey, tmp_path_factory.mktemp("data"), None) as client:
        yield client


@pytest.fixture(scope="module")
def driven(survey: Survey) -> str:
    """An inspection on `desk` whose counter is read."""
    return survey.id


@pytest.fixture(scope="module")
def short(films: Path) -> Path:
    """Shows no unit."""
    return counter_drives.write(
        CounterDrive(50, unit="", stuck=None, reset_at=None), films / "short.mp4"
    )


@pytest.fixture(scope="module")
def plain(films: Path) -> Path:
    """Shows no counter, which is found out in a fifth of the time that reading one takes."""
    drive = CounterDrive(20, stuck=None, reset_at=None, has_counter=False)
    return counter_drives.write(drive, films / "plain.mp4")


def state(client: Client, inspection: str, **stated: Any) -> dict[str, Any]:
    answer = client.put(f"/api/inspections/{inspection}/counter", json=stated)
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def test_the_counter_is_read_after_the_tracking_and_compared_with_it(
    desk: Client, driven: str
) -> None:
    found = counter(desk, driven)
    left, top, right, bottom = found["box"]
    assert 0 <= left < 20
    assert right < 150
    assert 200 <= top < bottom <= counter_drives.HEIGHT
    assert (found["unit"], found["is_unit_shown"], found["is_box_drawn"]) == ("m", True, False)
    assert found["legible"] > 0.95 * found["frames"] == 0.95 * DRIVE.frames
    length = found["comparison"]["length"]
    assert length["scale"] == pytest.approx(DRIVE.scale, abs=2 * length["scale_sigma"])
    assert length["length_m"] == pytest.approx(
        DRIVE.scale * STEP_MM / 1000 * (length["last_frame"] - length["first_frame"]), abs=0.011
    )
    stuck, reset = found["comparison"]["faults"]
    assert (stuck["kind"], reset["kind"]) == ("stuck", "reset")
    assert stuck["first_frame"] == pytest.approx(80, abs=4)
    assert stuck["last_frame"] == pytest.approx(112, abs=4)
    assert (reset["first_frame"], reset["last_frame"]) == (149, 150)


def test_counters_that_nobody_asked_for_wait_while_films_do(
    films: Path, plain: Path, tmp_path: Path
) -> None:
    long = make_clip(films / "long.mp4", 100)
    with serving(tmp_path, max_jobs=1, pace=0.4) as client:
        first, second = inspect(client, plain), inspect(client, plain)
        running, queued = client.inspect(long), client.inspect(long)
        client.wait(running, "running")
        assert client.inspection(queued)["status"] == "queued"
        state(client, second, is_present=True)
        assert settled(client, second)["state"] == "not_found"
        assert counter(client, first)["state"] == "waiting"
        for each in (queued, running):
            client.post(f"/api/inspections/{each}/cancel")
        assert settled(client, first)["state"] == "not_found"


def test_the_readings_come_as_a_table_and_as_columns(desk: Client, driven: str) -> None:
    path = f"/api/inspections/{driven}/counter/readings"
    header, *rows = desk.get(path).text.splitlines()
    assert header == "frame,time_s,reading,unit,confidence"
    read = np.array([float(row.split(",")[2] or "nan") for row in rows])
    wrong = np.abs(1000 * read - DRIVE.counter_mm()) > TICK_MM
    assert wrong.sum() <= 0.01 * DRIVE.frames
    head, _, packed = desk.get(path, params={"format": "columns"}).content.partition(b"\n")
    assert b'"counter_m","float64"' in head
    assert np.frombuffer(packed, "<f8") == pytest.approx(read, nan_ok=True)


def test_its_length_can_be_stated_as_a_known_one(desk: Client, driven: str) -> None:
    length = counter(desk, driven)["comparison"]["length"]
    names = ("first_frame", "last_frame", "length_m", "sigma_mm")
    stated = {"lengths": [{name: length[name] for name in names} | {"kind": "known"}]}
    answer = desk.post(f"/api/inspections/{driven}/corrections/preview", json=stated).json()
    assert answer["error"] is None
    assert answer["result"]["scale"] == pytest.approx(DRIVE.scale, abs=0.02)


def test_a_film_without_a_counter_is_told_so_and_its_date_is_read(
    desk: Client, films: Path
) -> None:
    drive = CounterDrive(12, stuck=None, reset_at=None, has_counter=False, date="2019/05/17")
    inspection = inspect(desk, counter_drives.write(drive, films / "none.mp4"))
    found = settled(desk, inspection)
    assert (found["state"], found["box"], found["comparison"]) == ("not_found", None, None)
    assert found["film_date"] == "2019-05-17"
    assert desk.get(f"/api/inspections/{inspection}/counter/readings").text.count("\n") == 1


def test_a_counter_without_a_unit_is_compared_once_somebody_states_it(
    desk: Client, short: Path
) -> None:
    inspection = inspect(desk, short)
    found = settled(desk, inspection)
    assert (found["unit"], found["comparison"], found["first_m"]) == (None, None, None)
    stated = state(desk, inspection, unit="m")
    assert (stated["state"], stated["version"]) == ("read", found["version"])  # not read again
    assert stated["comparison"]["length"]["scale"] == pytest.approx(DRIVE.scale, abs=0.05)


def test_a_person_draws_the_box_or_says_that_there_is_none(desk: Client, short: Path) -> None:
    inspection = inspect(desk, short, is_present=False)
    desk.wait(inspection)
    assert counter(desk, inspection)["state"] == "declined"
    # No text stands there.
    assert state(desk, inspection, box=[200, 20, 300, 50])["state"] == "waiting"
    found = settled(desk, inspection)
    assert (found["state"], found["is_box_drawn"]) == ("not_found", True)
    assert found["box"] == [200, 20, 300, 50]
    state(desk, inspection, box=[0, 200, 200, 240], unit="m")
    assert settled(desk, inspection)["state"] == "read"
    assert state(desk, inspection, is_present=False)["state"] == "declined"


@pytest.mark.parametrize(
    ("box", "code"),
    [
        ([300, 200, 340, 230], "pixel_outside_picture"),
        ([30, 30, 20, 60], "invalid_request"),
        ([30, 30, 33, 60], "invalid_request"),
        ([0, 0, 100], "invalid_request"),
        ([-5, 0, 100, 20], "invalid_request"),
        ([0.5, 0, 100, 20], "invalid_request"),
    ],
)
def test_a_box_outside_the_picture_is_refused(
    desk: Client, driven: str, short: Path, box: list[float], code: str
) -> None:
    before = counter(desk, driven)
    assert_error(desk.put(f"/api/inspections/{driven}/counter", json={"box": box}), 422, code)
    assert counter(desk, driven) == before
    made = desk.create(short, rig=counter_drives.rig(), counter={"box": box})
    assert_error(made, 422, code)


def test_reading_can_be_cancelled_and_asked_for_again(desk: Client, plain: Path) -> None:
    inspection = inspect(desk, plain)
    desk.wait(inspection)
    path = f"/api/inspections/{inspection}/counter/cancel"
    assert desk.post(path).json()["state"] == "cancelled"
    assert_error(desk.post(path), 409, "not_running")
    assert state(desk, inspection)["state"] == "waiting"
    assert settled(desk, inspection)["state"] == "not_found"


def test_a_reading_that_a_restart_interrupts_is_done_again(tmp_path: Path, plain: Path) -> None:
    with serving(tmp_path / "data") as client:
        inspection = inspect(client, plain)
        wait_until(lambda: counter(client, inspection)["progress"])
    with serving(tmp_path / "data") as client:
        assert settled(client, inspection)["state"] == "not_found"


def test_a_reader_that_dies_is_told_and_can_be_tried_again(
    desk: Client, plain: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("app.tracking.counter_queue.CHILD", "app.jobs.no_such_module")
        inspection = inspect(desk, plain)
        found = settled(desk, inspection)
    assert found["state"] == "failed"
    assert "ended by itself with exit code 1" in found["detail"]
    state(desk, inspection)
    assert settled(desk, inspection)["state"] == "not_found"


def test_who_is_not_logged_in_or_names_no_inspection_gets_nothing(
    desk: Client, driven: str
) -> None:
    assert_error(desk.anonymous().get(f"/api/inspections/{driven}/counter"), 401, "unauthenticated")
    unknown = "0" * 32
    for method, path in (("GET", ""), ("PUT", ""), ("POST", "/cancel"), ("GET", "/readings")):
        url = f"/api/inspections/{unknown}/counter{path}"
        body = {"json": {}} if method == "PUT" else {}
        assert_error(desk.request(method, url, **body), 404, "inspection_not_found")


def test_the_counter_of_an_upload_is_found(desk: Client, driven: str) -> None:
    upload = desk.upload(desk.get(f"/api/inspections/{driven}/video").content)
    found = desk.get(f"/api/uploads/{upload}/counter").json()
    assert found["box"] == counter(desk, driven)["box"]
    assert (found["width"], found["height"], found["unit"]) == (320, 240, "m")
    assert found["film_date"] is None
