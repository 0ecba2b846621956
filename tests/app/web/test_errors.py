from pathlib import Path

from builders import TOKEN, Client, LiveServer, assert_error

from app.errors import STATUS, code_of
from app.main import create_app
from app.settings import Settings


def test_nothing_here_and_no_such_method_have_the_one_body(shared: Client) -> None:
    assert_error(shared.get("/api/nowhere"), 404, "not_found")
    assert_error(shared.get("/static/nowhere.js"), 404, "not_found")
    assert_error(shared.delete("/api/inspections"), 405, "method_not_allowed")


def test_a_body_that_does_not_fit_is_named(shared: Client) -> None:
    for body, part in (
        (b"{", "JSON"),
        (b"[]", "dictionary"),
        (b'{"token": 5}', "token"),
        (b'{"token": "x", "more": 1}', "more"),
        (b"{}", "token"),
    ):
        headers = {"Content-Type": "application/json"}
        answer = shared.post("/api/login", content=body, headers=headers)
        assert part in assert_error(answer, 422, "invalid_request")


def test_a_body_that_is_too_large_is_not_read(shared: Client) -> None:
    answer = shared.post("/api/login", json={"token": "x" * 2**21})
    assert_error(answer, 413, "body_too_large")


def test_an_unforeseen_fault_is_reported_plainly_and_the_server_goes_on(tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, token=TOKEN))

    @app.get("/api/fault")
    def fault() -> None:
        raise ZeroDivisionError("secret detail")

    server = LiveServer(app)
    try:
        with Client(server, TOKEN) as client:
            answer = client.get("/api/fault")
            assert "secret" not in assert_error(answer, 500, "internal_error")
            assert answer.headers["X-Content-Type-Options"] == "nosniff"
            assert client.get("/healthz").status_code == 200
    finally:
        server.stop()


def test_every_error_has_its_own_code() -> None:
    codes = [code_of(kind) for kind in STATUS]
    assert len(set(codes)) == len(codes)
