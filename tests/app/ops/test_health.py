import sqlite3
from contextlib import closing
from pathlib import Path

from builders import Client, assert_error, serving, wait_until
from small_disk import small_disk

from app.ops.health import Health


def test_alive_and_ready_need_no_token(shared: Client) -> None:
    stranger = shared.anonymous()
    assert stranger.get("/healthz").json() == {"status": "alive"}
    ready = stranger.get("/readyz").json()
    assert ready["status"] == "ready"
    assert {check["name"] for check in ready["checks"]} == {
        "database", "disk", "store", "workers", "tracking", "sqlite",
    }  # fmt: skip
    assert all(check["ok"] and check["detail"].endswith(".") for check in ready["checks"])


def test_a_full_disk_makes_it_not_ready_and_it_says_so(tmp_path: Path) -> None:
    with serving(tmp_path, disk_reserve_bytes=2**50) as client:
        assert "disk" in assert_error(client.get("/readyz"), 503, "not_ready")
        assert client.get("/healthz").status_code == 200


def test_a_full_disk_is_a_database_that_takes_no_writes(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk") as disk, serving(disk.place / "data") as client:
        assert client.get("/readyz").status_code == 200
        disk.fill()
        detail = wait_until(lambda: not_ready(client))
        assert "database: " in detail
        assert "disk: The disk is nearly full." in detail
        disk.make_room()
        wait_until(lambda: client.get("/readyz").status_code == 200)


def test_a_database_that_another_program_holds_makes_it_not_ready(server: Client) -> None:
    with closing(sqlite3.connect(server.data / "chainage.db")) as other:
        other.execute("BEGIN IMMEDIATE")
        assert "database: It accepts no writes" in wait_until(lambda: not_ready(server))
        assert server.get("/api/inspections").status_code == 200
        other.rollback()
    wait_until(lambda: server.get("/readyz").status_code == 200)


def not_ready(client: Client) -> str | None:
    answer = client.get("/readyz")
    return assert_error(answer, 503, "not_ready") if answer.status_code != 200 else None


def test_a_thread_that_fails_begins_again_and_one_that_fails_on_and_on_is_named(
    tmp_path: Path,
) -> None:
    with serving(tmp_path) as client, closing(sqlite3.connect(tmp_path / "chainage.db")) as other:
        other.execute("ALTER TABLE archive_films RENAME TO away")
        detail = wait_until(lambda: not_ready(client))
        assert "workers: archive-intake has failed" in detail
        assert "OperationalError" in detail
        assert client.get("/healthz").status_code == 200


def test_a_server_that_is_asked_to_stop_reports_it_before_it_does(server: Client) -> None:
    server.server.app.state.services[Health].stop()
    assert "shutting down" in assert_error(server.get("/readyz"), 503, "not_ready")
    assert server.get("/api/inspections").status_code == 200
