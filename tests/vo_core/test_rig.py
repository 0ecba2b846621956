"""The rig file: what it takes, and what it says when it does not."""

import json

import pytest
from textures import make_rig, rig_fields

from vo_core import InvalidRig, Rig
from vo_core.geometry.rectify import require_wall_in_view

FLOOR = {"shape": "flat", "diameter_mm": None}
WAVES = {"pitch_mm": 67.7, "depth_mm": 13.0}


def test_the_rig_of_the_design_document_is_read(tmp_path):
    path = tmp_path / "rig.json"
    path.write_text(json.dumps(rig_fields()))
    rig = Rig.load(path)
    assert (rig.camera.fx, rig.mount.height_mm, rig.pipe.diameter_mm) == (1194.0, 230.0, 300.0)
    assert (rig.camera.skew, rig.camera.distortion, rig.mount.lateral_mm) == (0.0, [], 0.0)


def test_whole_numbers_are_numbers():
    assert make_rig(camera={"fx": 1194}).camera.fx == 1194


def test_a_written_rig_reads_back_the_same(tmp_path):
    rig = make_rig(camera={"distortion": [0.1, -0.2, 0.0, 0.0]}, mount={"pitch_deg": 2.0})
    path = tmp_path / "rig.json"
    path.write_text(json.dumps(rig.model_dump(mode="json")))
    assert Rig.load(path) == rig


def test_equal_rigs_are_one_key():
    bent, same, other = (
        make_rig(camera={"distortion": [k1, -0.2, 0.0, 0.0]}) for k1 in (0.1, 0.1, 0.11)
    )
    assert len({bent, same, other}) == 2


@pytest.mark.parametrize(
    ("part", "change", "said"),
    [
        ("camera", {"fx": 0}, ["camera.fx", "greater than 1", "0"]),
        ("camera", {"fx": False}, ["camera.fx", "valid number", "False"]),
        ("camera", {"fx": float("nan")}, ["camera.fx", "finite"]),
        ("camera", {"model": "omni"}, ["camera.model", "'pinhole' or 'fisheye'", "'omni'"]),
        ("camera", {"width": 20}, ["camera.width", "greater than or equal to 32", "20"]),
        ("camera", {"distortion": [0.1, 0.2]}, ["2 numbers", "0, 4, 5, 8, 12 or 14"]),
        ("camera", {"zoom": 2}, ["camera.zoom", "not permitted"]),
        ("mount", {"height_mm": -1.0}, ["mount.height_mm", "greater than 0", "-1"]),
        (
            "mount",
            {"height_mm": 320.0},
            ["mount.height_mm: 320 mm", "outside the pipe of 300", "unit?"],
        ),
        ("mount", {"view": "up"}, ["mount.view", "'down' or 'forward'"]),
        ("pipe", {"diameter_mm": None}, ["diameter_mm is missing", "50 to 20000"]),
        ("pipe", {"shape": "flat"}, ["diameter_mm", "flat floor"]),
        ("pipe", {**FLOOR, "corrugation": WAVES}, ["corrugation", "flat floor"]),
        ("pipe", {"corrugation": {"pitch_mm": 67.7}}, ["pipe.corrugation.depth_mm"]),
        ("pipe", {"corrugation": WAVES | {"pitch_mm": 0.0677}}, ["corrugation.pitch_mm", "5"]),
    ],
)
def test_a_wrong_value_is_named_with_what_is_allowed(part, change, said):
    with pytest.raises(InvalidRig) as raised:
        make_rig(**{part: change})
    for words in said:
        assert words in str(raised.value)


def test_every_wrong_field_is_named_at_once():
    with pytest.raises(InvalidRig, match=r"camera.fx.*mount.height_mm"):
        make_rig(camera={"fx": -1}, mount={"height_mm": 0})


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[]", b"null", b"[" * 10_000])
def test_a_file_that_is_no_rig_is_refused_by_name(tmp_path, content):
    path = tmp_path / "strange.json"
    path.write_bytes(content)
    with pytest.raises(InvalidRig, match=r"strange\.json"):
        Rig.load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidRig, match=r"nowhere\.json cannot be read"):
        Rig.load(tmp_path / "nowhere.json")


def test_every_field_is_described_and_bounded():
    definitions = Rig.model_json_schema()["$defs"]
    for part in ("Camera", "Mount", "Pipe", "Corrugation"):
        for name, field in definitions[part]["properties"].items():
            assert field.get("description"), f"{part}.{name} has no description"


def test_pictures_of_another_size_are_refused():
    with pytest.raises(InvalidRig, match=r"640 x 480.*1920 x 1080"):
        make_rig().require_picture_size(1920, 1080)


@pytest.mark.parametrize(
    ("part", "change", "said"),
    [
        ("camera", {"fx": 8.0}, ["camera.fx: 8 px", "177 degrees", "85 px", "focal length in mm"]),
        ("camera", {"fy": 3.6}, ["camera.fy: 3.6 px", "480 px of height", "focal length in mm"]),
        ("camera", {"model": "fisheye", "fx": 1.4}, ["camera.fx: 1.4 px", "fisheye", "51 px"]),
        ("camera", {"cx": 5000.0}, ["camera.cx: 5000 px", "640 px", "about 319.5"]),
        (
            "mount",
            {"height_mm": 0.23},
            ["mount.height_mm: 0.23 mm", "5 mm", "230 if it is in metr"],
        ),
        ("mount", {"height_mm": 4.5}, ["mount.height_mm: 4.5 mm", "45 if it is in centimetres"]),
        ("pipe", {"diameter_mm": 0.3}, ["pipe.diameter_mm", "50", "0.3", "300 if it is in metres"]),
        (
            "pipe",
            {"diameter_mm": 12.0},
            ["304.8 if it is in inches", "120 if it is in centimetres"],
        ),
        ("pipe", {"diameter_mm": 150.0}, ["outside the pipe of 150 mm", "the radius"]),
        ("pipe", {"segment_length_mm": 1.5}, ["segment_length_mm", "1500 if it is in metres"]),
    ],
)
def test_a_rig_that_cannot_be_is_refused_with_what_was_probably_meant(part, change, said):
    with pytest.raises(InvalidRig) as raised:
        make_rig(**{part: change})
    for words in said:
        assert words in str(raised.value)


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("camera", {"fx": 160.0, "fy": 160.0}),  # 127 degrees
        ("camera", {"model": "fisheye", "fx": 105.0, "fy": 105.0}),
        ("camera", {"cx": -200.0, "cy": 700.0}),
        ("mount", {"height_mm": 23.0}),
        ("mount", {"view": "forward", "pitch_deg": 45.0}),
        ("pipe", {"diameter_mm": 2400.0}),
    ],
)
def test_a_rig_that_is_merely_unusual_is_taken(part, change):
    make_rig(**{part: change})


def test_a_stored_rig_is_read_as_it_is():
    stored = rig_fields(camera={"fx": 8.0, "fy": 8.0})
    assert Rig.model_validate(stored).camera.fx == 8


@pytest.mark.parametrize("pipe", [FLOOR, {}])
def test_a_view_that_sees_no_wall_is_refused_with_what_to_check(pipe):
    """Over a floor it looks into the sky; in a pipe at the crown only."""
    up = make_rig(mount={"pitch_deg": 80.0, "view": "forward"}, pipe=pipe)
    with pytest.raises(InvalidRig, match=r"past the wall.*pitch_deg 80.*nose up"):
        require_wall_in_view(up)
    require_wall_in_view(make_rig())
