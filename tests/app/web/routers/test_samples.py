"""The sample inspection: rendered in a child, imported, tagged, made once."""

import signal
from pathlib import Path
from typing import Any

import pytest
from builders import Client, assert_error, children, send_signal, serving, wait_until

from app.inspections.films import samples
from app.lab.simulation.sample import SAMPLE, tags

CHILD = "app.jobs.requests.sample"


def ended(client: Client) -> dict[str, Any]:
    """The state when it is not rendered any more."""

    def state() -> dict[str, Any] | None:
        now = dict(client.get("/api/samples").json())
        return now if now["state"] != "rendering" else None

    return wait_until(state)


def test_the_sample_is_rendered_once_and_comes_with_tags(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In 60 mm there is no defect, so a tag of the whole sample is put into the third frame."""
    tag = tags(SAMPLE)[0].model_copy(update={"frame": 3})
    monkeypatch.setattr(samples, "LENGTH_MM", 60.0)
    monkeypatch.setattr("app.lab.simulation.sample.tags", lambda _scenario: [tag])
    with serving(tmp_path) as client:
        assert client.get("/api/samples").json() == {
            "state": "none", "progress": 0.0, "inspection_id": None, "error": None,
        }  # fmt: skip
        assert client.post("/api/samples").status_code == 202
        assert_error(client.post("/api/samples"), 409, "sample_being_made")
        made = ended(client)
        assert (made["state"], made["progress"]) == ("ready", 1.0)
        path = f"/api/inspections/{made['inspection_id']}"
        client.state_no_counter(made["inspection_id"])
        inspection = client.wait(made["inspection_id"])
        assert (inspection["name"], inspection["status"]) == ("Sample culvert", "done")
        assert inspection["distance_m"] == pytest.approx(0.06, abs=0.005)
        assert client.patch(path, json={"header": inspection["header"]}).is_success
        (crack,) = client.get(f"{path}/observations").json()["observations"]
        assert (crack["code"], crack["clock"]) == ("BAB", 5)
        assert crack["frame"] == 3
        assert client.post("/api/samples").json() == made
    with serving(tmp_path) as client:
        assert client.get("/api/samples").json() == made
        client.delete(path)
        assert client.get("/api/samples").json()["state"] == "none"
        client.post("/api/samples")
        again = ended(client)
        assert again["state"] == "ready"
        assert again["inspection_id"] != made["inspection_id"]
        assert children(CHILD) == []  # the video was kept
        client.delete(f"/api/inspections/{again['inspection_id']}")


def test_a_renderer_that_dies_is_reported_and_tried_again_and_ends_with_its_server(
    tmp_path: Path,
) -> None:
    with serving(tmp_path) as client:
        client.post("/api/samples")
        send_signal(CHILD, signal.SIGKILL)
        state = ended(client)
        assert (state["state"], state["error"]["code"]) == ("failed", "sample_failed")
        assert "SIGKILL" in state["error"]["detail"]
        assert client.post("/api/samples").json()["state"] == "rendering"
        wait_until(lambda: children(CHILD))
    assert children(CHILD) == []
    assert list((tmp_path / "inspections").iterdir()) == []


def test_a_disk_without_room_is_reported(tmp_path: Path) -> None:
    with serving(tmp_path, disk_reserve_bytes=2**50) as client:
        client.post("/api/samples")
        state = ended(client)
    assert state["state"] == "failed"
    assert "not enough room" in state["error"]["detail"]
