"""Each check fires over what it is for, and clears when that is put right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from builders import STEP_MM, clip_rig
from tracks import look, straight_track

from app.survey.adjustment.adjust import adjust
from app.survey.catalogue import built_in
from app.survey.distances.corrected import Corrected
from app.survey.distances.stated import Joints, Stated, Typed, Zero
from app.survey.observations.checks import Case, Issue, run
from app.survey.observations.records import Observation
from app.survey.observations.tag import StatedTag
from app.survey.places.place import ObservationView, Trajectory, place_of
from vo_core import Rig, Track
from vo_core.image.health import TOO_DARK

FRAMES = 160
END_M = (FRAMES - 1) * STEP_MM / 1000
DRIVE = straight_track(STEP_MM * np.arange(FRAMES))
RIG = Rig.parse(clip_rig())
CLEAR = {
    "overlap": np.ones(FRAMES), "brightness": np.full(FRAMES, 0.5), "overexposed": np.zeros(FRAMES),
    "sharpness": np.ones(FRAMES), "fixed_pattern": np.zeros(FRAMES),
}  # fmt: skip
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

Tag = Mapping[str, Any]


def case(
    *tags: Tag,
    header: Mapping[str, Any] = HEADER,
    stated: Stated = Stated(),  # noqa: B008
    raw: Track = DRIVE,
    joints_mm: tuple[float, ...] = (),
    is_photographed: bool = True,
) -> Case:
    """A run with start and finish and everything else that a report needs, and tags."""
    adjusted = adjust(raw, RIG, stated, look(raw, joints_mm))
    trajectory = Trajectory(adjusted, raw)
    rows = [
        row(seq, tag, is_photographed) for seq, tag in enumerate((START, FINISH, *tags), start=1)
    ]
    return Case(
        header=header,
        views=[ObservationView(row, place_of(trajectory, row.tag)) for row in rows],
        table=built_in(),
        corrected=Corrected(stated, adjusted, None),
        track=adjusted.track,
        health=CLEAR,
        photo_is_there=lambda _: True,
    )


def row(seq: int, tag: Tag, is_photographed: bool) -> Observation:
    return Observation(
        inspection_id="i",
        id=str(seq),
        seq=seq,
        tag=StatedTag(**tag),
        photo_frame=tag["frame"] if is_photographed else None,
        created_at=datetime(2026, 3, 1, tzinfo=UTC),
        created_by="A",
    )


def found(of: Case) -> list[tuple[str, str]]:
    return [(issue.level, issue.code) for issue in run(of)]


def the_issue(of: Case) -> Issue:
    (issue,) = run(of)
    return issue


def test_frames_between_two_typed_distances_are_said_to_be_uncertain() -> None:
    blind = replace(DRIVE, status=np.full(FRAMES, "lost"), time_s=10 * DRIVE.time_s)
    ends = (Typed(frame=0, distance_m=0.0), Typed(frame=FRAMES - 1, distance_m=END_M))
    found = {one.code: one.params for one in run(case(raw=blind, stated=Stated(typed=ends)))}
    assert 50 < found["uncertain"]["percent"] < 100
    assert "uncertain" not in {one.code for one in run(case())}


def test_a_run_in_good_order_has_no_checks() -> None:
    stretch = stretch_of(85, 110)
    assert found(case(CRACK, *stretch)) == []


@pytest.mark.parametrize("name", [name for name in HEADER if name != "known_length_m"])
def test_an_empty_required_field_blocks(name: str) -> None:
    issue = the_issue(case(header=HEADER | {name: None}))
    assert (issue.level, issue.code) == ("block", "header_field_empty")
    assert issue.params == {"field": name}


def test_an_abandoned_survey_needs_its_reason() -> None:
    abandoned = HEADER | {"end_condition": "abandoned"}
    without = ("block", "abandoned_without_reason")
    assert without in found(case(header=abandoned))
    assert without not in found(case(header=abandoned | {"abandon_reason": "deep water"}))


def test_start_and_finish_are_needed() -> None:
    complete = case()
    start, finish = complete.views
    assert found(replace(complete, views=[])) == [("block", "no_start"), ("block", "no_finish")]
    assert found(replace(complete, views=[finish])) == [("block", "no_start")]
    assert found(replace(complete, views=[start])) == [("block", "no_finish")]
    abandoned = HEADER | {"end_condition": "abandoned", "abandon_reason": "deep water"}
    stopped = case({"frame": 159, "code": "BDC", "char1": "B"}).views[-1]
    assert found(replace(complete, header=abandoned, views=[start, stopped])) == []


def test_start_and_finish_are_proposed_at_zero_and_at_the_far_end() -> None:
    beyond = {"frame": FRAMES - 1, "pixel": [300.0, 120.0], "code": "BCA"}
    of = case(beyond)
    start, finish, *others = of.views
    zero, end = run(replace(of, views=[finish]))[0], run(replace(of, views=[start]))[0]
    assert zero.params == {"needed": "BCD", "frame": 0, "distance_m": 0.0}
    far = {"frame": FRAMES - 1, "distance_m": pytest.approx(END_M, abs=0.006)}
    assert end.params == {"needed": "BCE/BDC", **far}
    # What the camera sees ahead of itself lies before the end, too.
    (end,) = [
        issue for issue in run(replace(of, views=[start, *others])) if "needed" in issue.params
    ]
    assert {name: end.params[name] for name in ("u", "v")} == {"u": 300.0, "v": 120.0}
    assert end.params["distance_m"] > END_M
    nothing = replace(of, views=[], track=straight_track(np.zeros(0)))
    assert run(nothing)[0].params == {"needed": "BCD"}


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        ([START | {"frame": 5}], [("block", "start_twice")]),
        ([FINISH | {"code": "BDC"}], [("block", "end_twice")]),
    ],
)
def test_start_and_end_stand_once(tags: list[Tag], expected: list[tuple[str, str]]) -> None:
    assert [each for each in found(case(*tags)) if "twice" in each[1]] == expected


def test_start_and_end_stand_around_all_others() -> None:
    of = case(CRACK)
    start, finish, crack = of.views

    def at(view: ObservationView, frame: int) -> ObservationView:
        assert view.place is not None
        return replace(view, place=replace(view.place, distance_mm=frame * STEP_MM))

    assert found(replace(of, views=[at(start, 100), finish, crack])) == [("warn", "before_start")]
    assert found(replace(of, views=[start, at(finish, 60), crack])) == [("warn", "after_end")]
    turned = [at(start, 150), at(finish, 10), crack]
    assert found(replace(of, views=turned)) == [("block", "end_before_start")]
    near = [at(start, 81), at(finish, 79), crack]  # within their intervals
    assert found(replace(of, views=near)) == []


def test_the_end_is_coded_as_the_header_has_it() -> None:
    abandoned = HEADER | {"end_condition": "abandoned", "abandon_reason": "deep water"}
    assert found(case(header=abandoned)) == [("block", "end_contradicts")]


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ({"height_mm": 304}, None),  # a tape errs as much
        ({"height_mm": 600}, {"field": "height_mm", "header_mm": 600, "rig_mm": 300}),
        ({"unit_length_m": 1}, {"field": "unit_length_m", "header_mm": 1000, "rig_mm": 1500}),
        ({"unit_length_m": 1.5, "height_mm": "300"}, None),
        ({"shape": "egg", "height_mm": 450, "width_mm": 300}, None),
    ],
)
def test_the_pipe_of_the_header_is_that_of_the_rig(
    header: dict[str, Any], expected: dict[str, Any] | None
) -> None:
    pipe = {"shape": "circular", "diameter_mm": 300.0, "segment_length_mm": 1500.0}
    rig = Rig.parse(clip_rig() | {"pipe": pipe})
    of = case(header=HEADER | header)
    adjusted = replace(of.corrected.adjusted, rig=rig)
    of = replace(of, corrected=replace(of.corrected, adjusted=adjusted))
    differs = [issue.params for issue in run(of) if issue.code == "rig_pipe_differs"]
    assert differs == ([] if expected is None else [expected])


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
def test_an_observation_must_be_complete(fields: Tag, expected: list[tuple[str, str]]) -> None:
    issues = run(case(CRACK | fields))
    assert [(issue.level, issue.code) for issue in issues] == expected
    assert all(issue.observation_id == "3" for issue in issues)


def stretch_of(first: int, last: int, number: int = 1, **other: Any) -> tuple[Tag, Tag]:
    return (
        CRACK | {"frame": first, "continuous": f"A{number}"},
        CRACK | {"frame": last, "continuous": f"B{number}"} | other,
    )


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
    first: int, last: int, other: Tag, expected: list[tuple[str, str]]
) -> None:
    assert found(case(*stretch_of(first, last, **other))) == expected


def test_a_number_is_of_one_stretch() -> None:
    twice = case(*stretch_of(85, 100), *stretch_of(110, 120))
    assert found(twice) == [("block", "stretch_number_twice")]


def test_the_same_defect_twice_is_reported() -> None:
    overlapping = (*stretch_of(85, 110, 1), *stretch_of(100, 125, 2))
    issue = the_issue(case(*overlapping))
    assert (issue.code, issue.params) == ("stretches_overlap", {"stretch": 1, "other": 2})
    points = (CRACK | {"frame": 50}, CRACK | {"frame": 52})
    elsewhere = CRACK | {"frame": 52, "clock_from": 9}
    issues = run(case(*overlapping, *points, elsewhere))
    assert [issue.code for issue in issues] == ["duplicate", "stretches_overlap"]


def test_what_lies_outside_the_asset_blocks() -> None:
    issue = the_issue(case(header=HEADER | {"known_length_m": 0.2}))
    assert (issue.code, issue.params["known_length_m"]) == ("beyond_end", 0.2)
    left = HEADER | {"known_length_m": END_M - 40 * STEP_MM / 1000}
    issue = the_issue(case(header=left, stated=Stated(zero=Zero(frame=40))))
    assert (issue.level, issue.code) == ("block", "before_zero")
    assert issue.params["distance_m"] == pytest.approx(-0.064, abs=0.001)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"known_length_m": None}, [("warn", "length_unknown")]),
        ({"known_length_m": END_M + 0.5}, [("warn", "end_not_reached")]),
        ({"known_length_m": END_M + 0.1}, [("warn", "end_not_reached")]),
        ({"known_length_m": END_M + 0.012}, []),  # 95 % of the run's sigma and that of a tape
        (
            {
                "known_length_m": END_M + 0.5, "end_condition": "abandoned", "abandon_reason": "x",
            },
            [("block", "end_contradicts")],
        ),
    ],
)  # fmt: skip
def test_the_end_is_where_it_is_said_to_be(
    fields: Mapping[str, Any], expected: list[tuple[str, str]]
) -> None:
    assert found(case(header=HEADER | fields)) == expected


def test_a_correction_that_cannot_be_applied_blocks() -> None:
    error = {"code": "invalid_correction", "detail": "Frame 9999 was not tracked."}
    complete = case()
    issue = the_issue(replace(complete, corrected=Corrected(Stated(), None, error)))
    assert (issue.level, issue.code) == ("block", "correction_failed")


def test_other_needs_a_remark() -> None:
    other = {"frame": 60, "code": "BDG", "char1": "Z"}
    assert found(case(other)) == [("warn", "other_without_remark")]
    assert found(case(other | {"remark": "a tree"})) == []


DISPLACED = {"frame": 20, "code": "BAJ", "char1": "B", "quant1": 5.0, "clock_from": 12}


def test_where_no_joint_was_seen_a_displaced_one_may_be_anywhere() -> None:
    assert found(case(DISPLACED)) == []


@pytest.mark.parametrize(("frame", "expected"), [(31, []), (50, [("warn", "no_joint_near")])])
def test_where_joints_were_seen_a_displaced_one_is_at_one_of_them(
    frame: int, expected: list[tuple[str, str]]
) -> None:
    """Seen every 1.2 m, of which the frames show 0.5 m and 0.8 m."""
    long = straight_track(10 * STEP_MM * np.arange(FRAMES))
    header = HEADER | {"known_length_m": 10 * END_M}
    joints_mm = (505.0, 1705.0)
    stated = Stated(joints=Joints(use=True))
    tag = DISPLACED | {"frame": frame}
    assert found(case(tag, header=header, stated=stated, raw=long, joints_mm=joints_mm)) == expected


def test_a_photo_that_is_gone_blocks_and_a_severe_defect_needs_one() -> None:
    severe = CRACK | {"severity": 4}
    kept = case(severe)
    assert found(kept) == []
    gone = replace(kept, photo_is_there=lambda view: view.row.id != "3")
    assert found(gone) == [("block", "photo_missing")]
    assert found(case(severe, is_photographed=False)) == [("warn", "severe_without_photo")]


def test_lost_frames_are_reported() -> None:
    status = np.where((DRIVE.frame >= 10) & (DRIVE.frame < 50), "lost", "ok")
    issue = the_issue(replace(case(), track=replace(DRIVE, status=status)))
    assert (issue.level, issue.code) == ("warn", "lost")
    assert issue.params == {"percent": 25.0, "frames": 40}


def test_dark_pictures_are_reported() -> None:
    brightness = CLEAR["brightness"].copy()
    brightness[10:50] = 0.5 * TOO_DARK
    issue = the_issue(replace(case(), health=CLEAR | {"brightness": brightness}))
    assert (issue.level, issue.code) == ("warn", "poor_pictures")
    assert issue.params == {"complaint": "too_dark", "percent": 25.0}


def test_a_tag_that_was_never_reached_is_reported() -> None:
    assert found(case(CRACK | {"frame": FRAMES})) == [("block", "not_tracked")]
