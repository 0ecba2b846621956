"""The rig file: what it takes, and what it says when it does not."""

import json

import pytest
from textures import make_rig, rig_fields

from vo_core import InvalidRig, Rig


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
        ("mount", {"height_mm": 320.0}, ["height_mm 320", "outside the pipe of 300"]),
        ("mount", {"view": "up"}, ["mount.view", "'down' or 'forward'"]),
        ("pipe", {"diameter_mm": None}, ["diameter_mm is missing", "50 to 20000"]),
        ("pipe", {"shape": "flat"}, ["diameter_mm", "flat floor"]),
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
    for part in ("Camera", "Mount", "Pipe"):
        for name, field in definitions[part]["properties"].items():
            assert field.get("description"), f"{part}.{name} has no description"


def test_pictures_of_another_size_are_refused():
    with pytest.raises(InvalidRig, match=r"640 x 480.*1920 x 1080"):
        make_rig().require_picture_size(1920, 1080)
