"""Track files: the columns that other programs rely on."""

import json
from dataclasses import fields

import numpy as np
import pytest

from vo_core import Estimate, InvalidTrack, Track

ROWS = [
    Estimate(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, "ok", 0.0),
    Estimate(1, 1 / 30, 10.0625, -0.5, 1.5, 10.0625, 0.25, 0.9, "weak", 0.125, 0.5, -0.25, 0.75),
    Estimate(2, 2 / 30, 20.0, -1.0, 90.0, 20.0, 4.0, 0.0, "lost", 3.5),
]
OLD_HEADER = "frame,time_s,x_mm,y_mm,yaw_deg,distance_mm,sigma_distance_mm,quality,status"
HEADER = OLD_HEADER + ",sigma_registration_mm,z_mm,pitch_deg,roll_deg,looking_around"


def test_the_csv_has_the_contracts_columns_after_its_metadata():
    lines = Track.from_estimates(ROWS).to_csv({"video": "a\nb.mp4"}).splitlines()
    assert lines[:2] == ["# video: a b.mp4", HEADER]
    contract = "1,0.033333,10.0625,-0.5000,1.50000,10.0625,0.2500,0.900,weak"
    assert lines[3] == contract + ",0.1250,0.5000,-0.25000,0.75000,0"


def test_a_csv_reads_back_the_same():
    track = Track.from_estimates(ROWS)
    again = Track.from_csv(track.to_csv({"any": 1}))
    assert again.frame.tolist() == [0, 1, 2]
    assert again.status.tolist() == ["ok", "weak", "lost"]
    assert np.allclose(again.x_mm, track.x_mm)


def test_a_file_of_old_holds_the_sigma_of_the_registration():
    track = Track.from_csv(f"{OLD_HEADER}\n0,0,0,0,0,0,0,1,ok\n1,0,9,0,0,9,0.2,1,ok\n")
    assert track.sigma_registration_mm.tolist() == [0.0, 0.2]
    assert not np.any([track.z_mm, track.pitch_deg, track.roll_deg, track.looking_around])


def test_an_empty_track_has_a_header_only():
    assert Track.from_estimates([]).to_csv() == HEADER + "\n"
    assert len(Track.from_csv(HEADER)) == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("frame,time_s\n0,0\n", "no column distance_mm, quality"),
        (f"# a\n{OLD_HEADER}\n0,0,0,0,0,0,0,1,ok\n1,x,0,0,0,0,0,1,ok\n", "Line 4"),
        (f"{OLD_HEADER}\n0,0,0,0,0,0,0,1,fine\n", "Line 2 .* 'fine'; allowed are ok, weak, lost"),
        (f"{OLD_HEADER}\n0,0,0\n", "Line 2"),
        (f"{OLD_HEADER}\n0,0,nan,0,0,0,0,1,ok\n", "Line 2 .*nan is not finite"),
        (f"{OLD_HEADER}\n1,0,0,0,0,0,0,1,ok\n1,0,0,0,0,0,0,1,ok\n", "Line 3 .* out of order"),
        ("", "no column"),
    ],
)
def test_a_wrong_track_is_refused_with_its_line(text, said):
    with pytest.raises(InvalidTrack, match=said):
        Track.from_csv(text)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("0.033333", "nan", "Line 4 .*nan is not finite"),
        ("weak", "weakly", "Line 4 .*'weakly'"),
        ("\n2,", "\n1,", "Line 5 .* out of order"),
        ("\n2,", "\n2,,", "Line 5"),
    ],
)
def test_a_wrong_line_of_our_own_file_is_named(old, new, said):
    text = Track.from_estimates(ROWS).to_csv({"any": 1}).replace(old, new)
    with pytest.raises(InvalidTrack, match=said):
        Track.from_csv(text)


def test_our_own_file_is_read_as_another_with_the_same_columns_is():
    text = Track.from_estimates(ROWS).to_csv({"any": 1})
    ours, other = (
        Track.from_csv(text),
        Track.from_csv(text.replace("looking_around", "looking_around,note")),
    )
    for field in fields(Track):
        one, same = getattr(ours, field.name), getattr(other, field.name)
        assert one.tolist() == same.tolist()
        assert one.dtype.kind == same.dtype.kind


def test_tum_is_in_metres_with_a_unit_quaternion():
    lines = Track.from_estimates(ROWS).to_tum().splitlines()
    values = np.array([line.split() for line in lines], float)
    assert values[2, :4] == pytest.approx([2 / 30, 0.02, -0.001, 0], abs=1e-6)
    assert values[1, 3] == pytest.approx(0.0005)
    assert np.linalg.norm(values[:, 4:], axis=1) == pytest.approx(np.ones(3))
    assert 2 * np.degrees(np.arctan2(values[2, 6], values[2, 7])) == pytest.approx(90)


def test_json_holds_the_columns():
    document = json.loads(Track.from_estimates(ROWS).to_json({"video": "a"}))
    assert document["metadata"] == {"video": "a"}
    assert document["columns"]["status"] == ["ok", "weak", "lost"]
    assert document["columns"]["distance_mm"][1] == 10.0625
