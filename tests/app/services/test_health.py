from pathlib import Path

from builders import Client, assert_error, serving


def test_alive_and_ready_need_no_token(shared: Client) -> None:
    stranger = shared.anonymous()
    assert stranger.get("/healthz").json() == {"status": "alive"}
    ready = stranger.get("/readyz").json()
    assert ready["status"] == "ready"
    assert {check["name"] for check in ready["checks"]} == {
        "database", "disk", "workers", "sqlite",
    }  # fmt: skip
    assert all(check["ok"] and check["detail"].endswith(".") for check in ready["checks"])


def test_a_full_disk_makes_it_not_ready_and_it_says_so(tmp_path: Path) -> None:
    with serving(tmp_path, disk_reserve_bytes=2**50) as client:
        assert "disk" in assert_error(client.get("/readyz"), 503, "not_ready")
        assert client.get("/healthz").status_code == 200
