"""What a monitoring system sees, read by Prometheus's own parser."""

from __future__ import annotations

import signal
from pathlib import Path

from builders import (
    PATIENCE_S,
    Client,
    assert_error,
    children,
    clip_rig,
    send_signal,
    serving,
    wait_until,
)
from cameras import MjpegCamera
from prometheus_client.parser import text_string_to_metric_families


def scraped(client: Client) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    answer = client.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["Content-Type"].startswith("text/plain; version=0.0.4")
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def value(client: Client, name: str, **labels: str) -> float:
    return scraped(client)[f"chainage_{name}", tuple(sorted(labels.items()))]


def test_nobody_sees_them_without_a_token(shared: Client) -> None:
    assert_error(shared.anonymous().get("/metrics"), 401, "unauthenticated")


def test_requests_are_counted_by_route_and_not_by_address(server: Client) -> None:
    for number in range(20):
        server.get(f"/api/inspections/{number:032x}?secret=1")
        server.get(f"/nowhere/{number}")
        server.get(f"/static/nowhere{number}.js")
        server.request(f"ODD{number}", "/api/inspections")
    found = scraped(server)
    counts = {
        labels: count for (name, labels), count in found.items()
        if name == "chainage_http_requests_total"
    }  # fmt: skip
    route = "/api/inspections/{inspection_id}"
    assert counts[("method", "GET"), ("route", route), ("status", "404")] == 20
    assert counts[("method", "GET"), ("route", "none"), ("status", "404")] == 20
    assert counts[("method", "GET"), ("route", "/static"), ("status", "404")] == 20
    assert sum(count for labels, count in counts.items() if ("method", "other") in labels) == 20
    assert len(counts) < 8
    assert "secret" not in server.get("/metrics").text
    seconds = ("method", "GET"), ("route", route)
    assert found["chainage_http_request_duration_seconds_count", seconds] == 20


def test_the_work_of_the_server_is_counted(server: Client, clip: Path, done: str) -> None:
    assert server.tracked(clip) != done
    server.tag(done)
    assert value(server, "inspections", status="done") == 2
    assert value(server, "inspections", status="running") == 0
    assert value(server, "tracked_frames_total") == 40
    assert value(server, "queue_length") == 0
    assert value(server, "database_write_duration_seconds_count") >= 3
    assert value(server, "disk_free_bytes") > 0
    assert value(server, "viewer_servers") == 0
    with (
        server.socket(f"/api/inspections/{done}/live") as socket,
        server.view(done) as view,
    ):
        socket.recv(PATIENCE_S)
        view.recv(PATIENCE_S)
        assert value(server, "websocket_clients", kind="live") == 1
        assert value(server, "viewer_servers") == 1
    wait_until(lambda: value(server, "websocket_clients", kind="live") == 0)
    found = scraped(server)
    assert found["process_resident_memory_bytes", ()] > 2**20
    assert found["process_cpu_seconds_total", ()] > 0
    (build,) = [dict(labels) for name, labels in found if name == "chainage_build_info"]
    assert build.keys() == {"version", "database"}


def test_a_run_shows_while_it_lasts_and_a_replaced_process_is_counted(
    tmp_path: Path, clip: Path, long_clip: Path
) -> None:
    settings = {"camera_networks": ("127.0.0.0/8",), "pace": 0.5}
    with MjpegCamera() as camera, serving(tmp_path / "data", **settings) as client:
        first, second = client.inspect(long_clip), client.inspect(clip)
        body = {"name": "Live", "rig": clip_rig(), "header": {}}
        body["source"] = {"kind": "live", "url": camera.url}
        live = client.post("/api/inspections", json=body).json()["id"]
        client.state_no_counter(live)
        wait_until(lambda: value(client, "tracked_frames_per_second") > 0)
        assert value(client, "queue_length") == 1
        assert value(client, "live_recordings") == 1
        assert value(client, "inspections", status="running") == 2
        assert value(client, "live_frames_dropped_total") >= 0
        assert value(client, "child_processes") >= 3
        before = set(children("app.jobs.requests.media"))
        send_signal("app.jobs.requests.media", signal.SIGKILL)
        frame = f"/api/inspections/{first}/frames/0.jpg"
        wait_until(
            lambda: client.get(frame) and before.isdisjoint(children("app.jobs.requests.media"))
        )
        # Who asks next finds that it has ended; on a busy machine the new one may hang, too.
        wait_until(
            lambda: client.get(frame) and value(client, "child_restarts_total", kind="media") >= 1
        )
        send_signal("app.jobs.live.camera", signal.SIGKILL)
        wait_until(lambda: value(client, "child_restarts_total", kind="camera") >= 1)
        for inspection_id in (first, second, live):
            client.post(f"/api/inspections/{inspection_id}/cancel")
