"""The burnt-in counter of an inspection: read after the tracking, compared, stated by people."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import uuid4

import counter_drives
import numpy as np
import pytest
from builders import Client, assert_error, make_clip, serving, wait_until
from counter_drives import STEP_MM, CounterDrive
from counter_surveys import DRIVE, counter, faulty_drive, inspect, settled
from surveys import Survey, another, served

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
def plain(films: Path) -> Path:
    """Shows a date and no counter, which is found out in a fifth of the time that reading takes."""
    drive = CounterDrive(12, stuck=None, reset_at=None, has_counter=False, date="2019/05/17")
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


def test_a_counter_without_a_unit_is_compared_once_somebody_states_it(
    desk: Client, survey: Survey
) -> None:
    inspection = another(survey, desk)
    file = desk.data / "inspections" / inspection / "counter.json"
    kept = json.loads(file.read_text())
    file.write_text(json.dumps(kept | {"place": kept["place"] | {"unit": ""}}))
    found = counter(desk, inspection)
    assert (found["unit"], found["comparison"], found["first_m"]) == (None, None, None)
    stated = state(desk, inspection, unit="m")
    assert (stated["state"], stated["version"]) == ("read", found["version"])  # not read again
    assert stated["comparison"]["length"]["scale"] == pytest.approx(DRIVE.scale, abs=0.05)


def test_a_counter_is_read_when_it_is_its_turn_or_somebody_asks_and_again_if_it_was_interrupted(
    plain: Path, survey: Survey, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, long = survey.copied_to(tmp_path / "data"), make_clip(tmp_path / "long.mp4", 100)
    with serving(data, max_jobs=1, pace=0.4) as client:
        running = client.inspect(long)
        client.wait(running, "running")
        inspection, queued = inspect(client, plain), client.inspect(long)
        waiting = client.inspect(long)  # from here on one waits all the time
        client.post(f"/api/inspections/{running}/cancel")
        client.wait(inspection)
        client.wait(queued, "running")
        assert counter(client, inspection)["state"] == "waiting", "films come first"
        path = f"/api/inspections/{inspection}/counter/cancel"
        assert client.post(path).json()["state"] == "cancelled"
        assert_error(client.post(path), 409, "not_running")

        # What somebody asks for does not wait.  No text stands in the box that a person draws.
        assert state(client, survey.id, box=[200, 20, 300, 50])["state"] == "waiting"
        found = settled(client, survey.id)
        assert (found["state"], found["is_box_drawn"]) == ("not_found", True)
        assert found["box"] == [200, 20, 300, 50]
        assert state(client, survey.id, is_present=False)["state"] == "declined"
        for each in (waiting, queued):
            client.post(f"/api/inspections/{each}/cancel")
        assert state(client, inspection)["state"] == "waiting"
        wait_until(lambda: counter(client, inspection)["progress"])

    with serving(data) as client:
        found = settled(client, inspection)
        assert (found["state"], found["box"], found["comparison"]) == ("not_found", None, None)
        assert found["film_date"] == "2019-05-17"
        assert client.get(f"/api/inspections/{inspection}/counter/readings").text.count("\n") == 1

        with monkeypatch.context() as patch:
            patch.setattr("app.tracking.pictures.counter_reading.CHILD", "app.jobs.no_such_module")
            state(client, inspection)
            found = settled(client, inspection)
        assert found["state"] == "failed"
        assert "ended by itself with exit code 1" in found["detail"]


def test_a_film_of_snow_has_its_distances_from_the_counter_and_then_from_a_person(
    films: Path, tmp_path: Path
) -> None:
    drive = CounterDrive(60, scale=1.0, stuck=None, reset_at=None, is_snow=True)
    film = counter_drives.write(drive, films / "snow.mp4")
    with serving(tmp_path / "data") as client:
        inspection = inspect(client, film)
        client.wait(inspection)
        assert settled(client, inspection)["state"] == "read"
        path = f"/api/inspections/{inspection}"
        tag = client.put(f"{path}/observations/{uuid4()}", json={"frame": 50, "code": "BAB"})
        assert tag.status_code == 200, tag.text
        found = wait_until(lambda: _of_source(client, path, "counter"))
        truth_m = drive.counter_mm()[50] / 1000
        assert found["distance_m"] == pytest.approx(truth_m, abs=found["distance_u95_m"])
        assert found["distance_u95_m"] < 0.05
        with_reason = [each["remark"] for each in client.get(f"{path}/events").json()["events"]]
        assert "The counter carries 100 % of the frames." in with_reason

        typed = [{"frame": 0, "distance_m": 12.0}, {"frame": 59, "distance_m": 13.0}]
        client.put(f"{path}/corrections", json={"typed": typed}).raise_for_status()
        found = _of_source(client, path, "typed")
        assert found["distance_m"] == pytest.approx(12 + 50 / 59, abs=0.002)
        csv = client.get(f"{path}/exports/csv").content.decode("utf-8-sig").splitlines()
        assert dict(zip(csv[0].split(","), csv[1].split(","), strict=True))[
            "distance_source"
        ] == "typed"  # fmt: skip


def _of_source(client: Client, path: str, source: str) -> dict[str, Any] | None:
    """Return the only observation once its distance has this source."""
    (found,) = client.get(f"{path}/observations").json()["observations"]
    return dict(found) if found["distance_source"] == source else None


def test_a_box_outside_the_picture_is_refused(desk: Client, driven: str, plain: Path) -> None:
    before = counter(desk, driven)
    for box, code in (
        ([300, 200, 340, 230], "pixel_outside_picture"),
        ([30, 30, 20, 60], "invalid_request"),
        ([30, 30, 33, 60], "invalid_request"),
        ([0, 0, 100], "invalid_request"),
        ([-5, 0, 100, 20], "invalid_request"),
        ([0.5, 0, 100, 20], "invalid_request"),
    ):
        assert_error(desk.put(f"/api/inspections/{driven}/counter", json={"box": box}), 422, code)
        made = desk.create(plain, rig=counter_drives.rig(), counter={"box": box})
        assert_error(made, 422, code)
    assert counter(desk, driven) == before


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
