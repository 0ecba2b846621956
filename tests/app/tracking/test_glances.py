"""One picture of a camera, before anything is recorded."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from builders import Client, assert_error, children, frame_number, serving
from cameras import Camera, MjpegCamera, RtspCamera

PATH = "/api/sources/picture"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    with serving(tmp_path_factory.mktemp("data"), camera_networks=("127.0.0.0/8",)) as running:
        yield running


@pytest.mark.parametrize("kind", [MjpegCamera, RtspCamera])
def test_it_is_what_the_camera_shows_and_nothing_is_stored(
    client: Client, kind: type[Camera]
) -> None:
    with kind() as camera:
        answer = client.post(PATH, json={"url": camera.url})
    assert (answer.status_code, answer.headers["Content-Type"]) == (200, "image/jpeg")
    assert frame_number(answer.content) >= 0
    assert client.get("/api/inspections").json()["inspections"] == []
    assert not children("app.jobs.live.glance")


def test_a_camera_that_is_away_or_not_allowed_says_so(client: Client) -> None:
    away = client.post(PATH, json={"url": "http://127.0.0.1:9/video"})
    assert "gives no picture" in assert_error(away, 422, "camera_unreachable")
    far = client.post(PATH, json={"url": "http://8.8.8.8/video"})
    assert_error(far, 422, "live_source_refused")
