"""The log of a real server: lines for programs, each with what it is about, none with a secret."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from builders import TOKEN, Client, LiveServer
from processes import process

from app.logs import LogFormat, about, configure, request_id
from app.main import create_app
from app.settings import Settings


@contextmanager
def configured(form: LogFormat) -> Iterator[None]:
    """As a server that has just started; within a request."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    root.handlers.clear()
    configure(form)
    request = request_id.set("0123")
    try:
        yield
    finally:
        request_id.reset(request)
        root.handlers[:] = handlers
        root.setLevel(level)


def test_each_line_is_an_object_with_what_it_is_about(capsys: pytest.CaptureFixture[str]) -> None:
    with configured("json"), about(32 * "a"):
        try:
            int("two\nlines")
        except ValueError:
            logging.getLogger("app.x").exception("It said %s.", "this\nand that")
    line, rest = capsys.readouterr().err.split("\n", 1)
    assert rest == ""
    fields = json.loads(line)
    assert "ValueError: invalid literal" in fields.pop("trace")
    assert fields.pop("time").endswith("+00:00")
    assert fields == {
        "level": "ERROR",
        "logger": "app.x",
        "message": "It said this\nand that.",
        "inspection": 32 * "a",
        "request_id": "0123",
    }


def test_a_readable_line_names_its_request(capsys: pytest.CaptureFixture[str]) -> None:
    with configured("text"):
        logging.getLogger("app.x").info("Within.")
        request_id.set(None)
        logging.getLogger("app.x").info("Outside.")
    within, outside = capsys.readouterr().err.splitlines()
    assert within.endswith("INFO app.x: Within. [0123]")
    assert outside.endswith("INFO app.x: Outside.")


def test_changes_and_failures_are_logged_and_no_secret_is(tmp_path: Path, clip: Path) -> None:
    with process(tmp_path / "data", LOG_FORMAT="json") as client:
        inspection_id = client.tracked(clip)
        tagged = client.tag(inspection_id)
        client.get("/healthz")
        client.get("/api/inspections?query-secret=1")
        client.get("/api/nowhere?query-secret=2")
        client.anonymous().get(f"/login?token={TOKEN}")
        session = client.anonymous()
        session.post("/api/login", json={"token": TOKEN})
        log = client.server.log.read_text()  # type: ignore[attr-defined]
    lines: list[dict[str, Any]] = [json.loads(line) for line in log.splitlines()]
    assert all({"time", "level", "logger", "message"} <= line.keys() for line in lines)
    requests = {line["request_id"]: line for line in lines if "route" in line}
    put = requests[tagged.headers["X-Request-Id"]]
    assert (put["method"], put["status"], put["level"]) == ("PUT", 200, "INFO")
    assert put["route"] == "/api/inspections/{inspection_id}/observations/{observation_id}"
    assert put["inspection"] == inspection_id
    assert put["duration_ms"] > 0
    assert {line["status"] for line in requests.values() if line["method"] == "GET"} <= {303, 404}
    (tracked,) = [line for line in lines if "tracking starts" in line["message"]]
    assert tracked["inspection"] == inspection_id
    assert "query-secret" not in log
    assert TOKEN not in log
    assert session.cookies[session.cookie_name] not in log


def test_an_unforeseen_fault_is_found_in_the_log_by_what_the_answer_says(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    app = create_app(Settings(data=tmp_path, token=TOKEN))

    @app.get("/healthz/fault")
    def fault() -> None:
        seen.append(request_id.get())
        raise ZeroDivisionError

    seen: list[str | None] = []
    server = LiveServer(app)
    try:
        with Client(server, TOKEN) as client:
            answer = client.get("/healthz/fault")
    finally:
        server.stop()
    assert answer.status_code == 500
    assert answer.headers["X-Request-Id"] == seen[0]
    assert f"as {seen[0]}." in answer.json()["detail"]
