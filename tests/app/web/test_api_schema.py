"""The API does what its OpenAPI document says, whatever is sent to it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import httpx
import pytest
import schemathesis
from builders import TOKEN, Client, assert_error, serving
from cameras import MjpegCamera
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable
from schemathesis import BaseSchema, Case, GenerationMode
from schemathesis.specs.openapi.checks import positive_data_acceptance
from surveys import Survey

SHARE = 10
"""Of the examples of other properties each of the operations is tried with one part in so many,
in the long run both fitting and unfit."""
Way = tuple[str | int, ...]
OBSERVATION, NO_OBSERVATION = (f"00000000-0000-4000-8000-00000000000{n}" for n in (1, 2))
NO_INSPECTION = "0" * 32
ENDINGS = ("/cancel", "/retry", "/finish")


@dataclass(frozen=True)
class Inspections:
    """Their ids, by what has become of them."""

    done: str
    running: str
    failed: str

    def for_operation(self, method: str, path: str) -> list[str]:
        """Which to try: none is deleted, and only one that has failed is ended or tracked again."""
        if method == "delete" and path.endswith("{inspection_id}"):
            return [NO_INSPECTION]
        if path.endswith(ENDINGS):
            return [self.failed, NO_INSPECTION]
        return [self.done, self.running, self.failed, NO_INSPECTION]


@dataclass(frozen=True)
class Api:
    """A server with something in it, and the operations that it states."""

    client: Client
    ids: Inspections
    schema: BaseSchema


@pytest.fixture(scope="module")
def api(tmp_path_factory: pytest.TempPathFactory, survey: Survey) -> Iterator[Api]:
    data = survey.copied_to(tmp_path_factory.mktemp("data"))
    with (
        MjpegCamera(rate_hz=2) as camera,
        MjpegCamera(rate_hz=2, size_wh=(320, 200)) as other,
        serving(data, camera_networks=("127.0.0.0/8",)) as client,
    ):
        ids = Inspections(survey.id, client.record(camera.url), client.record(other.url))
        client.wait(ids.running, "running")
        client.wait(ids.failed, "failed")
        for inspection_id in (ids.done, ids.running, ids.failed):
            assert client.tag(inspection_id, OBSERVATION).status_code == 200
        described = client.get("/api/openapi.json").json()
        schema = schemathesis.openapi.from_dict(narrowed(described, ids))
        schema.config.update(
            base_url=client.server.url, headers={"Authorization": f"Bearer {TOKEN}"}
        )
        yield Api(client, ids, schema)


def narrowed(described: dict[str, Any], ids: Inspections) -> dict[str, Any]:
    """An OpenAPI document whose ids exist, most of them."""
    for path, methods in described["paths"].items():
        for method, operation in methods.items():
            for parameter in operation.get("parameters", ()):
                if parameter["name"] == "inspection_id":
                    parameter["schema"] = {"enum": ids.for_operation(method, path)}
                elif parameter["name"] == "observation_id":
                    parameter["schema"] = {"enum": [OBSERVATION, NO_OBSERVATION]}
    return described


def operations(schema: BaseSchema) -> list[tuple[str, str]]:
    """Method and path of all but the one that renders a sample for minutes."""
    return [
        (method, path)
        for path in schema
        for method in schema[path]
        if (method, path) != ("post", "/api/samples")
    ]


def test_every_operation_answers_as_its_schema_says(api: Api, *, is_long: bool) -> None:
    faults = []
    for n, (method, path) in enumerate(operations(api.schema)):
        operation = api.schema[path][method]
        modes = [GenerationMode.POSITIVE, GenerationMode.NEGATIVE]
        if not is_long:  # one of them; without a body or a query next to everything fits
            modes = modes[n % 2 :][:1] if operation.body or operation.query else modes[:1]
        for mode in modes:
            try:
                check(operation.as_strategy(generation_mode=mode).filter(reaches_it))
            except Unsatisfiable:
                assert mode == GenerationMode.NEGATIVE, (method, path)  # everything fits
            except Exception as fault:
                faults.append(f"{method} {path}: {fault}")
    assert not faults, "\n".join(faults)


def check(cases: st.SearchStrategy[Case]) -> None:
    """Raises the first fault."""

    @settings(
        max_examples=max(1, settings().max_examples // SHARE),
        suppress_health_check=list(HealthCheck),
        phases=(Phase.generate, Phase.shrink),
    )
    @given(cases)
    def answers(case: Case) -> None:
        # What fits the schema may still be refused: a frame that the video does not have.
        case.call_and_validate(excluded_checks=[positive_data_acceptance])

    answers()


def reaches_it(case: Case) -> bool:
    """Whether its path is that of its operation: a `?` or a slash in an id makes it another one."""
    ids = [str(value) for value in (case.path_parameters or {}).values()]
    return not any(value in ("", ".", "..") or set(value) & set("?#/\\") for value in ids)


NO_NUMBER = (
    "false", "true", '"1"', '""', "NaN", "Infinity", "-Infinity", "1e999", "9" * 5000,
    "1" + 400 * "0", "18446744073709551616", "-1e308", "[]", "{}", "[1]",
)  # fmt: skip
"""JSON that is no number, or none that any field takes."""
NO_TEXT = (
    "false", "1", r'"\ud800"', r'"\u0000"', r'"\u001b[2J"', r'"\u009b2J"', "[]", "{}",
    json.dumps("x" * 100_000),
)  # fmt: skip
"""JSON that is no text, or none that any field takes."""
NO_BODY = (
    b"", b"{", b"NaN", b"[]", b"null", b"\xff", b"9" * 100_000, b"[" * 100_000,
    b'{"a":' * 100_000, rb'{"\ud800": 1}', rb'{"\u0000": 1}',
)  # fmt: skip

TAG = {
    "frame": 3, "pixel": [10.5, 20.5], "code": "BAB", "char1": "A", "quant1": 1.5, "quant2": 2.5,
    "clock_from": 3, "clock_to": 4, "severity": 2, "remark": "wet",
}  # fmt: skip
STATED = {
    "zero": {"frame": 2, "offset_m": 0.1},
    "lengths": [{"first_frame": 0, "last_frame": 9, "length_m": 0.0144, "sigma_mm": 5.0}],
    "joints": {"marked": [{"frame": 3, "pixel": [10.5, 20.5]}], "left_out": [{"frame": 4}]},
    "rig_sigma": {"height_mm": 1.0, "focal_px": 1.0},
}
ENDED = {"end_condition": "abandoned", "abandon_reason": "wall", "known_length_m": 1.5}
BODIES: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("PUT", "/observations/" + OBSERVATION, TAG),
    ("PUT", "/corrections", STATED),
    ("POST", "/corrections/preview", STATED),
    ("POST", "/finish", ENDED),
    ("PATCH", "", {"name": "Culvert 7"}),
)


def places(value: Any, path: Way = ()) -> Iterator[tuple[Way, Any]]:
    """Every value within a body, with the way to it."""
    yield path, value
    if isinstance(value, dict | list):
        children = value.items() if isinstance(value, dict) else enumerate(value)
        for key, child in children:
            yield from places(child, (*path, key))


def wrong_for(value: Any) -> tuple[str, ...]:
    """JSON that must not be taken in place of a value."""
    if isinstance(value, str):
        return NO_TEXT
    if isinstance(value, dict):
        return ("[]", "1", '"{}"', json.dumps({**value, "own": 1}))
    if isinstance(value, list):
        return ("{}", "1", '"[]"', "true")
    return NO_NUMBER


def with_json(body: Any, way: Way, text: str) -> str:
    """A body as JSON, with other JSON in one place of it."""
    mark = "here"
    changed = deepcopy({"root": body})
    holder: Any = changed
    *steps, last = ("root", *way)
    for step in steps:
        holder = holder[step]
    holder[last] = mark
    return json.dumps(changed["root"]).replace(json.dumps(mark), text)


def send(api: Api, method: str, place: str, content: str | bytes) -> httpx.Response:
    return api.client.request(
        method, f"/api/inspections/{api.ids.done}{place}", content=content,
        headers={"Content-Type": "application/json"},
    )  # fmt: skip


def test_models_are_strict(api: Api, *, is_long: bool) -> None:
    for method, place, body in BODIES:
        assert send(api, method, place, json.dumps(body)).status_code == 200
    step = 1 if is_long else 4  # another share of the wrong values in each place
    accepted = [
        (method, place, way, text[:40], answer.text)
        for method, place, body in BODIES
        for n, (way, value) in enumerate(places(body))
        for text in wrong_for(value)[n % step :: step]
        if (answer := send(api, method, place, with_json(body, way, text))).status_code
        not in (400, 422)
    ]
    assert accepted == []


def test_what_is_no_body_is_refused(api: Api) -> None:
    for method, place, _ in BODIES:
        for content in NO_BODY:
            answer = send(api, method, place, content)
            code = "bad_request" if answer.status_code == 400 else "invalid_request"
            assert_error(answer, 400 if code == "bad_request" else 422, code)


def test_a_header_holds_no_number_that_readers_of_json_round(api: Api) -> None:
    for value in (2**53 + 1, -(2**64), 10**400):
        answer = send(api, "PATCH", "", json.dumps({"header": {"own": value}}))
        assert "header.own" in assert_error(answer, 422, "invalid_request")


def test_what_a_client_made_up_is_reported_legibly_and_in_short(api: Api) -> None:
    name = "\x1b[2J" + 100_000 * "x"
    detail = assert_error(
        send(api, "PATCH", "", json.dumps({name: 1, "name": 1})), 422, "invalid_request"
    )
    assert detail.isprintable()
    assert len(detail) < 1000
    source = {"kind": 100_000 * "x"}
    answer = api.client.post("/api/inspections", json={"name": "x", "source": source, "rig": {}})
    assert len(assert_error(answer, 422, "invalid_request")) < 10_000


def test_there_is_no_video_of_a_camera_that_gave_no_picture(api: Api) -> None:
    answer = api.client.get(f"/api/inspections/{api.ids.failed}/video")
    assert_error(answer, 409, "nothing_recorded")
