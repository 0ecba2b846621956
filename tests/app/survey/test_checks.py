"""Each check fires over what it is for, and clears when that is put right."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from builders import STEP_MM, Client, make_clip

FRAMES = 160
END_M = (FRAMES - 1) * STEP_MM / 1000
HEADER = {
    "asset_id": "CUL-1", "start_node": "in", "end_node": "out", "direction": "with_flow",
    "date": "2026-03-01", "time": "10:00", "operator": "A", "client": "B",
    "asset_type": "culvert", "shape": "circular", "height_mm": 300, "material": "concrete",
    "reference_point": "headwall", "standard": "EN 13508-2", "end_condition": "complete",
    "known_length_m": END_M,
}  # fmt: skip
START = {"frame": 0, "code": "BCD", "char1": "E"}
FINISH = {"frame": FRAMES - 1, "code": "BCE", "char1": "E"}
CRACK = {
    "frame": 80, "code": "BAB", "char1": "B", "char2": "A", "quant1": 2.0, "clock_from": 3,
}  # fmt: skip


@pytest.fixture(scope="module")
def run(shared: Client, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A run with everything that a report needs; tests tidy up after themselves."""
    clip = make_clip(tmp_path_factory.mktemp("clips") / "drive.mp4", FRAMES)
    inspection_id = shared.inspect(clip, header=HEADER)
    shared.wait(inspection_id)
    for tag in (START, FINISH):
        shared.tag(inspection_id, **tag)
    return inspection_id


@pytest.fixture
def tag(shared: Client, run: str) -> Any:
    """Tags that are deleted after the test."""
    made: list[str] = []

    def put(**fields: Any) -> str:
        name = str(uuid.uuid4())
        answer = shared.tag(run, name, **fields)
        assert answer.status_code == 200, answer.text
        made.append(name)
        return name

    yield put
    for name in made:
        shared.delete(f"/api/inspections/{run}/observations/{name}")


@pytest.fixture
def header(shared: Client, run: str) -> Any:
    """Changes that are taken back after the test."""
    yield lambda **fields: shared.patch(
        f"/api/inspections/{run}", json={"header": HEADER | fields}
    ).raise_for_status()
    shared.patch(f"/api/inspections/{run}", json={"header": HEADER})


def checks(client: Client, run: str) -> list[dict[str, Any]]:
    return list(client.get(f"/api/inspections/{run}/checks").raise_for_status().json()["checks"])


def told(client: Client, run: str) -> list[tuple[str, str]]:
    return [(check["level"], check["code"]) for check in checks(client, run)]


Tag = Callable[..., str]
Header = Callable[..., None]


def test_a_run_in_good_order_has_no_checks(shared: Client, run: str, tag: Tag) -> None:
    tag(**CRACK)
    tag(**CRACK | {"frame": 85, "continuous": "A1"})
    tag(**CRACK | {"frame": 110, "continuous": "B1"})
    assert told(shared, run) == []


@pytest.mark.parametrize("name", [name for name in HEADER if name != "known_length_m"])
def test_an_empty_required_field_blocks(
    shared: Client, run: str, header: Header, name: str
) -> None:
    header(**{name: None})
    (check,) = checks(shared, run)
    assert (check["level"], check["code"]) == ("block", "header_field_empty")
    assert check["params"] == {"field": name}
    assert name in check["detail"]


def test_an_abandoned_survey_needs_its_reason(shared: Client, run: str, header: Header) -> None:
    header(end_condition="abandoned")
    assert told(shared, run) == [("block", "abandoned_without_reason")]
    header(end_condition="abandoned", abandon_reason="deep water")
    assert told(shared, run) == []


def test_start_and_finish_are_needed(shared: Client, clip: Path) -> None:
    inspection_id = shared.inspect(clip, header=HEADER | {"known_length_m": 0.06})
    shared.wait(inspection_id)
    assert told(shared, inspection_id) == [("block", "no_start"), ("block", "no_finish")]
    shared.tag(inspection_id, **START)
    shared.tag(inspection_id, frame=30, code="BDC", char1="B")
    assert told(shared, inspection_id) == []


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"code": None}, [("block", "no_code")]),
        ({"code": "XYZ"}, [("block", "unknown_code")]),
        ({"char1": None, "char2": None}, [("block", "attribute_missing")]),
        ({"char1": "Q"}, [("block", "unknown_character")]),
        ({"quant1": None}, [("block", "attribute_missing")]),
        ({"clock_from": None}, [("block", "attribute_missing")]),
        ({"severity": 5}, []),  # it has a photo
        ({"continuous": "A7"}, [("block", "open_stretch")]),
        ({"continuous": "B7"}, [("block", "stretch_without_start")]),
        ({"continuous": "C7"}, [("block", "stretch_without_start")]),
    ],
)
def test_an_observation_must_be_complete(
    shared: Client, run: str, tag: Tag, fields: dict[str, Any], expected: list[tuple[str, str]]
) -> None:
    name = tag(**CRACK | fields)
    found = checks(shared, run)
    assert [(check["level"], check["code"]) for check in found] == expected
    assert all(check["observation_id"] == name for check in found)


def stretch_of(tag: Tag, first: int, last: int, number: int = 1, **other: Any) -> None:
    tag(**CRACK | {"frame": first, "continuous": f"A{number}"})
    tag(**CRACK | {"frame": last, "continuous": f"B{number}"} | other)


@pytest.mark.parametrize(
    ("first", "last", "other", "expected"),
    [
        (85, 110, {"char1": "A"}, [("block", "stretch_codes_differ")]),
        (110, 85, {}, [("block", "stretch_falls")]),
        (85, 87, {}, [("warn", "stretch_is_point")]),
        (20, 140, {}, [("warn", "stretch_long")]),
        (85, 110, {"quant1": None, "clock_from": None}, []),
    ],
)
def test_a_stretch_has_one_code_and_a_length(
    shared: Client,
    run: str,
    tag: Tag,
    first: int,
    last: int,
    other: dict[str, Any],
    expected: list[tuple[str, str]],
) -> None:
    stretch_of(tag, first, last, **other)
    assert told(shared, run) == expected


def test_a_number_is_of_one_stretch(shared: Client, run: str, tag: Tag) -> None:
    stretch_of(tag, 85, 100)
    stretch_of(tag, 110, 120)
    assert told(shared, run) == [("block", "stretch_number_twice")]


def test_the_same_defect_twice_is_reported(shared: Client, run: str, tag: Tag) -> None:
    stretch_of(tag, 85, 110, 1)
    stretch_of(tag, 100, 125, 2)
    (check,) = checks(shared, run)
    assert (check["code"], check["params"]) == ("stretches_overlap", {"stretch": 1, "other": 2})
    tag(**CRACK | {"frame": 50})
    tag(**CRACK | {"frame": 52})
    tag(**CRACK | {"frame": 52, "clock_from": 9})
    assert [code for _, code in told(shared, run)] == ["duplicate", "stretches_overlap"]


def test_what_lies_outside_the_asset_blocks(
    shared: Client, run: str, tag: Tag, header: Header
) -> None:
    header(known_length_m=0.2)
    (check,) = checks(shared, run)
    assert (check["code"], check["params"]["known_length_m"]) == ("beyond_end", 0.2)
    header()
    path = f"/api/inspections/{run}/corrections"
    shared.put(path, json={"zero": {"frame": 40, "offset_m": 0.0}}).raise_for_status()
    (check,) = checks(shared, run)
    assert (check["level"], check["code"]) == ("block", "before_zero")
    assert check["params"]["distance_m"] == pytest.approx(-0.064, abs=0.001)
    shared.put(path, json={}).raise_for_status()
    assert told(shared, run) == []


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"known_length_m": None}, [("warn", "length_unknown")]),
        ({"known_length_m": END_M + 0.5}, [("warn", "end_not_reached")]),
        ({"known_length_m": END_M + 0.2}, []),
        (
            {
                "known_length_m": END_M + 0.5, "end_condition": "abandoned", "abandon_reason": "x",
            },
            [],
        ),
    ],
)  # fmt: skip
def test_the_end_is_where_it_is_said_to_be(
    shared: Client,
    run: str,
    header: Header,
    fields: dict[str, Any],
    expected: list[tuple[str, str]],
) -> None:
    header(**fields)
    assert told(shared, run) == expected


def test_other_needs_a_remark(shared: Client, run: str, tag: Tag) -> None:
    other = {"frame": 60, "code": "BDC", "char1": "A", "char2": "Z"}
    name = tag(**other)
    assert told(shared, run) == [("warn", "other_without_remark")]
    shared.tag(run, name, **other, remark="a tree")
    assert told(shared, run) == []


def test_where_no_joint_was_seen_a_displaced_one_may_be_anywhere(
    shared: Client, run: str, tag: Tag
) -> None:
    tag(frame=20, code="BAJ", char1="B", quant1=5.0, clock_from=12)
    assert told(shared, run) == []


def test_a_photo_that_is_gone_blocks_and_a_severe_defect_needs_one(
    shared: Client, run: str, tag: Tag
) -> None:
    name = tag(**CRACK | {"severity": 4})
    photo = shared.data / "inspections" / run / "photos" / f"{name}-80.jpg"
    content = photo.read_bytes()
    photo.unlink()
    assert told(shared, run) == [("block", "photo_missing")]
    photo.write_bytes(content)
    assert told(shared, run) == []
    video = shared.data / "inspections" / run / "video.mp4"
    video.rename(video.with_name("away.mp4"))
    shared.tag(run, name, **CRACK | {"severity": 4, "frame": 81})
    assert told(shared, run) == [("warn", "severe_without_photo")]
    video.with_name("away.mp4").rename(video)


def test_lost_and_dark_frames_are_reported(server: Client, clip: Path, tmp_path: Path) -> None:
    dark = with_dark_frames(clip, tmp_path / "dark.mp4", range(10, 20))
    inspection_id = server.inspect(dark, header=HEADER)
    server.wait(inspection_id)
    found = checks(server, inspection_id)
    (check,) = [c for c in found if c["code"] == "lost"]
    assert check["level"] == "warn"
    assert check["params"] == {"percent": 25.0, "frames": 10}
    poor = [c["params"] for c in found if c["code"] == "poor_pictures"]
    assert {"complaint": "too_dark", "percent": 25.0} in poor


def with_dark_frames(clip: Path, out: Path, dark: range) -> Path:
    """The same video with the light off for a while."""
    with av.open(str(clip)) as source, av.open(str(out), "w") as target:
        shape = source.streams.video[0]
        stream = target.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = shape.width, shape.height, "yuv420p"
        for number, frame in enumerate(source.decode(video=0)):
            picture = frame.to_ndarray(format="gray") * np.uint8(number not in dark)
            target.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="gray")))
        target.mux(stream.encode())
    return out


def test_a_tag_that_was_never_reached_is_reported(server: Client, long_clip: Path) -> None:
    inspection_id = server.inspect(long_clip, header=HEADER)
    server.wait(inspection_id, "running")
    server.tag(inspection_id, **CRACK | {"frame": 1400})
    server.post(f"/api/inspections/{inspection_id}/cancel")
    server.wait(inspection_id)
    assert ("block", "not_tracked") in told(server, inspection_id)
