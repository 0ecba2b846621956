"""What follows from what was stated, on tracks whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import clip_rig
from hypothesis import given
from hypothesis import strategies as st

from app.survey.adjustment.adjust import adjust
from app.survey.adjustment.adjusted_track import Adjusted
from app.survey.distances.corrected import Corrected, result_of
from app.survey.distances.stated import Joints, LeftOut, Length, Mark, RigSigma, Stated, Zero
from app.survey.distances.track_rows import estimate_at, since
from app.viewer.scene_feed import joint_marks
from vo_core import Rig, Track
from vo_core.errors import InvalidCorrection
from vo_core.geometry.height import scale_sigma
from vo_core.joints.sightings import Sighting

FRAMES = 301
SEGMENT_MM = 1500.0
TRUE_MM = np.linspace(0, 12_000, FRAMES)
FIELDS = clip_rig()
RIG = Rig.parse(FIELDS | {"pipe": {"shape": "flat", "segment_length_mm": SEGMENT_MM}})


def make_track(distance_mm: np.ndarray, sigma_mm: float = 5.0) -> Track:
    """With a drift that grows to `sigma_mm`."""
    count = len(distance_mm)
    return Track(
        frame=np.arange(count),
        time_s=np.arange(count) / 30,
        x_mm=distance_mm,
        y_mm=np.zeros(count),
        yaw_deg=np.zeros(count),
        distance_mm=distance_mm,
        sigma_distance_mm=sigma_mm * np.sqrt(np.arange(count) / FRAMES),
        quality=np.full(count, 0.9),
        status=np.array(["ok"] * count),
        sigma_registration_mm=sigma_mm * np.sqrt(np.arange(count) / FRAMES),
        **dict.fromkeys(("z_mm", "pitch_deg", "roll_deg", "looking_around"), np.zeros(count)),
    )


RAW = make_track(TRUE_MM / 1.01)


def taped(length_m: float) -> Length:
    return Length(first_frame=0, last_frame=300, length_m=length_m)


def known(length_m: float) -> Length:
    return taped(length_m).model_copy(update={"sigma_mm": 20.0, "kind": "known"})


TAPE = taped(12.0)
KNOWN = known(12.0)


def joints_at(*true_mm: float, scale: float = 1.01) -> list[Sighting]:
    """Each seen in the frame before it."""
    frames = [max(int(np.searchsorted(TRUE_MM, at)) - 1, 0) for at in true_mm]
    return [
        Sighting(frame, float((at - TRUE_MM[frame]) / scale), 0.2, -0.3)
        for at, frame in zip(true_mm, frames, strict=True)
    ]


JOINTS = Joints(use=True)
SEEN = joints_at(*(800 + SEGMENT_MM * np.arange(7)))


def adjusted(stated: Stated, sightings: list[Sighting] | None = None, raw: Track = RAW) -> Adjusted:
    return adjust(raw, RIG, stated, sightings or [])


def test_nothing_stated_leaves_the_track_as_it_is() -> None:
    same = adjusted(Stated())
    assert same.track.distance_mm == pytest.approx(RAW.distance_mm)
    assert (same.scale, same.source) == (1.0, "odometry")
    assert same.scale_sigma == pytest.approx(scale_sigma(RIG))


def test_the_interval_has_the_tolerance_of_the_rig_in_it_from_the_zero_on() -> None:
    found = adjusted(Stated(zero=Zero(frame=100)))
    way_mm = RAW.distance_mm - RAW.distance_mm[100]
    by_rig = scale_sigma(RIG) * np.abs(way_mm)
    drift = np.sqrt(np.abs(RAW.sigma_registration_mm**2 - RAW.sigma_registration_mm[100] ** 2))
    assert found.track.sigma_distance_mm == pytest.approx(np.hypot(by_rig, drift), abs=1e-6)


def test_a_rig_has_nothing_to_do_with_what_another_program_has_measured() -> None:
    imported = replace(
        RAW,
        sigma_distance_mm=np.zeros(FRAMES),
        sigma_registration_mm=np.zeros(FRAMES),
        quality=np.zeros(FRAMES),
    )
    found = adjusted(Stated(zero=Zero(frame=0, offset_m=1.0)), raw=imported)
    assert not found.track.sigma_distance_mm.any()
    assert (found.scale_sigma, found.distance_class()) == (None, None)


@given(
    frame=st.integers(0, FRAMES - 1),
    offset_m=st.floats(-5, 5),
    length=st.none() | st.floats(11.8, 12.4),
)
def test_the_zero_frame_has_its_offset_after_scaling(
    frame: int, offset_m: float, length: float | None
) -> None:
    lengths = () if length is None else (taped(length),)
    found = adjusted(Stated(zero=Zero(frame=frame, offset_m=offset_m), lengths=lengths))
    assert found.track.distance_mm[frame] == pytest.approx(1000 * offset_m, abs=1e-6)
    assert found.track.sigma_distance_mm[frame] == pytest.approx(0, abs=1e-3)
    assert found.track.x_mm == pytest.approx(found.track.distance_mm)
    way_mm = np.diff(found.track.distance_mm[[0, 300]])[0]
    if length is None:
        assert way_mm == pytest.approx(RAW.distance_mm[300])
    else:  # the rig has a say too, by its uncertainty
        assert way_mm == pytest.approx(1000 * length, abs=2)
    assert found.metadata()["zero"] == f"frame {frame} at {offset_m:.3f} m"


def test_a_tape_scales_and_says_so() -> None:
    found = adjusted(Stated(lengths=(TAPE,)))
    assert found.scale == pytest.approx(1.01, abs=1e-4)
    assert found.track.distance_mm[-1] == pytest.approx(12_000, abs=1)
    assert found.track.sigma_distance_mm[-1] < 6 < adjusted(Stated()).track.sigma_distance_mm[-1]
    assert found.source == "odometry"
    assert found.closure is None
    assert found.metadata()["scale"].startswith("1.0099")


def test_a_known_length_gives_the_closure() -> None:
    found = adjusted(Stated(lengths=(KNOWN,)))
    assert found.source == "closure"
    assert found.closure is not None
    assert found.closure.residual_mm == pytest.approx(12_000 / 1.01 - 12_000)
    assert found.closure.residual_percent == pytest.approx(-0.990, abs=0.001)
    # The tolerance of the rig; the drawing adds 20 mm, the drift 5.
    by_rig_mm = scale_sigma(RIG) * 12_000 / 1.01
    assert found.closure.sigma_mm == pytest.approx(np.hypot(by_rig_mm, 20.6), rel=0.01)
    assert found.track.distance_mm[-1] == pytest.approx(12_000, abs=4)


def test_a_known_length_that_cannot_be_is_left_out_and_reported() -> None:
    found = adjusted(Stated(lengths=(known(13.0),)))
    assert found.refused is not None
    said = found.refused.refusal()
    assert "-1119 mm (-8.61 %)" in said
    assert "wrong asset" in said
    assert found.track.distance_mm == pytest.approx(RAW.distance_mm)


def test_a_rig_that_is_known_well_refuses_more() -> None:
    of_rig = RigSigma(height_mm=0.2)  # 0.1 % of 200 mm
    found = adjusted(Stated(lengths=(KNOWN,), rig_sigma=of_rig))
    assert found.closure is not None
    assert found.refused is found.closure
    assert adjusted(Stated(lengths=(KNOWN,))).refused is None


def test_a_forced_length_holds_against_the_rig() -> None:
    found = adjusted(
        Stated(lengths=(KNOWN,), rig_sigma=RigSigma(height_mm=0.2), forced="I taped it")
    )
    assert found.refused is None
    assert found.scale == pytest.approx(1.01)
    assert found.closure is not None
    assert not found.closure.is_plausible


def test_the_uncertainty_of_the_rig_widens_every_interval() -> None:
    # 0.5 % of 200 mm over a floor, in place of the tape that the rig file stands for
    level = RIG.known_to(tilt_deg=0.0)
    found = adjust(RAW, level, Stated(rig_sigma=RigSigma(height_mm=1.0)), [])
    wider = np.hypot(RAW.sigma_registration_mm, 0.005 * RAW.distance_mm)
    assert found.track.sigma_distance_mm == pytest.approx(wider, rel=0.001)
    assert found.track.distance_mm == pytest.approx(RAW.distance_mm)


def test_joints_are_numbered_from_the_zero_and_scale_the_track() -> None:
    found = adjusted(Stated(joints=Joints(use=True)), SEEN)
    assert found.source == "joint"
    assert found.scale == pytest.approx(1.01, abs=1e-3)
    assert [joint.number for joint in found.joints] == [1, 2, 3, 4, 5, 6, 7]
    assert [j.distance_mm for j in found.joints] == pytest.approx(
        [800 + SEGMENT_MM * n for n in range(7)], abs=12
    )
    assert not any(joint.is_marked for joint in found.joints)
    names = [
        left.name for left in adjusted(Stated(lengths=(TAPE,), joints=JOINTS), SEEN).residuals()
    ]
    assert names[:2] == [
        "12 m ± 5 mm between frames 0 and 300", f"joint 1 in frame {SEEN[0].frame}",
    ]  # fmt: skip
    assert len(names) == 8


@pytest.mark.parametrize(("zero_at", "first"), [(0, 1), (45, 0), (100, -2)])
def test_joint_numbers_follow_the_zero(zero_at: int, first: int) -> None:
    found = adjusted(Stated(zero=Zero(frame=zero_at), joints=Joints(use=True)), SEEN)
    assert found.sighted[0].number == first


def test_a_seam_at_the_zero_is_the_begin_of_the_pipe() -> None:
    seen = joints_at(*(40 + SEGMENT_MM * np.arange(6)))
    found = adjusted(Stated(joints=Joints(use=True)), seen)
    assert [joint.number for joint in found.sighted] == [0, 1, 2, 3, 4, 5]
    assert found.joint_near(50) is None


@given(at_mm=st.floats(300, 11_500))
def test_beside_a_place_is_a_joint_only_where_one_was_seen(at_mm: float) -> None:
    seen = 800 + SEGMENT_MM * np.array([0, 1, 2, 5, 6])
    nearest = int(np.abs(seen - at_mm).argmin())
    gap_mm = abs(seen[nearest] - at_mm)
    near = FITTED.joint_near(at_mm)
    if gap_mm < 190:
        assert near is not None
        assert near.number == (1, 2, 3, 6, 7)[nearest]
    elif gap_mm > 210:
        assert near is None


FITTED = adjusted(Stated(joints=Joints(use=True)), [SEEN[0], SEEN[1], SEEN[2], SEEN[5], SEEN[6]])
"""Two joints were not seen."""


def test_joints_are_expected_whole_segments_from_those_that_were_seen() -> None:
    expected = FITTED.expected_joints
    assert [joint.number for joint in expected] == [4, 5, 8]
    assert [joint.distance_mm for joint in expected] == pytest.approx([5300, 6800, 11_300], abs=20)


@pytest.mark.parametrize(("zero", "numbers"), [(None, []), (Zero(frame=0), list(range(1, 8)))])
def test_where_no_joint_was_seen_they_are_expected_from_the_zero_that_was_set(
    zero: Zero | None, numbers: list[int]
) -> None:
    found = adjusted(Stated(zero=zero))
    expected = found.expected_joints
    assert [joint.number for joint in expected] == numbers
    assert [joint.distance_mm for joint in expected] == [SEGMENT_MM * n for n in numbers]
    assert found.joint_near(SEGMENT_MM) is None


def test_joints_bring_a_run_to_scale_of_which_nobody_has_said_so() -> None:
    by_themselves, as_stated = adjusted(Stated(), SEEN), adjusted(Stated(joints=JOINTS), SEEN)
    assert by_themselves.source == "joint"
    assert by_themselves.track.distance_mm == pytest.approx(as_stated.track.distance_mm)


def test_joints_that_do_not_count_are_where_they_were_seen() -> None:
    found = adjusted(Stated(joints=Joints(use=False), lengths=(TAPE,)), SEEN)
    assert found.source == "odometry"
    assert [joint.number for joint in found.joints] == [1, 2, 3, 4, 5, 6, 7]
    assert {joint.residual_mm for joint in found.joints} == {None}
    assert found.joint_near(2300) is not None
    assert [left.name for left in found.residuals()] == ["12 m ± 5 mm between frames 0 and 300"]


def test_joints_that_agree_with_the_rig_count_among_as_many_other_rings() -> None:
    others = joints_at(1500.0, 4100.0, 6250.0, 8000.0)
    found = adjusted(Stated(), [*SEEN[:4], *others])
    assert (found.source, found.scale) == ("joint", pytest.approx(1.01, abs=0.003))


@pytest.mark.parametrize(("bed", "source"), [(0.0, "odometry"), (0.11, "joint")])
def test_two_joints_overrule_the_rig_where_the_wall_shows_a_bed(bed: float, source: str) -> None:
    deep = make_track(TRUE_MM / 0.9)
    noticed = np.where(deep.distance_mm > 300, np.hypot(0.01, bed), 0.01)
    whole = np.hypot(deep.sigma_registration_mm, noticed * deep.distance_mm)
    seen = joints_at(800.0, 2300.0, scale=0.9)
    found = adjusted(Stated(), seen, replace(deep, sigma_distance_mm=whole))
    assert found.source == source
    errors_mm = np.abs(found.track.distance_mm - TRUE_MM)
    assert (errors_mm <= 3 * found.track.sigma_distance_mm + 1e-6).all() == (bed > 0)


def test_rings_that_cannot_be_counted_are_not_forced() -> None:
    rng = np.random.default_rng(0)
    found = adjusted(Stated(), joints_at(*np.sort(rng.uniform(100, 11_900, 9))))
    assert (found.scale, found.source, found.joints) == (1.0, "odometry", ())
    assert found.joints_refusal is not None
    assert found.joints_refusal.sentence.endswith(".")
    assert found.joints_refusal.reason == "uncountable"
    assert found.joints_refusal.values["n"] == 9


def test_joints_that_contradict_a_tape_are_not_forced() -> None:
    stated = Stated(lengths=(taped(12.4),))
    found = adjusted(stated, SEEN)
    assert found.source == "odometry"
    assert found.scale == pytest.approx(1.0437, abs=0.001)
    assert found.joints_refusal is not None
    assert found.joints_refusal.reason == "contradiction"


def test_a_ring_that_is_no_joint_is_left_out() -> None:
    stated = Stated(joints=Joints(use=True, left_out=(LeftOut(frame=SEEN[3].frame),)))
    found = adjusted(stated, SEEN)
    assert [joint.number for joint in found.joints] == [1, 2, 3, 5, 6, 7]


def test_marked_joints_alone_are_enough() -> None:
    marks = []
    for sighting in SEEN:
        # Over a floor 200 mm below, a pixel is 0.8 mm: image-right is ahead.
        u = (FIELDS["camera"]["width"] - 1) / 2 + sighting.ahead_mm / 0.8
        marks.append(Mark(frame=sighting.frame, pixel=(u, 60.0)))
    found = adjusted(Stated(joints=Joints(marked=tuple(marks))))
    assert [joint.is_marked for joint in found.joints] == [True] * 7
    assert found.scale == pytest.approx(1.01, abs=1e-3)


def test_joints_find_a_known_length_out() -> None:
    stated = Stated(lengths=(known(12.2),), joints=Joints(use=True))
    found = adjusted(stated, SEEN)
    assert found.refused is not None
    assert found.refused.residual_mm == pytest.approx(-200, abs=20)
    assert found.source == "joint"
    assert adjusted(Stated(lengths=stated.lengths)).refused is None  # 2.7 % of a rig may be


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        (Stated(zero=Zero(frame=301)), "no frame 301 in the track"),
        (Stated(lengths=(Length(first_frame=0, last_frame=999, length_m=12.0),)), "no frame 999"),
        (Stated(lengths=(taped(120.0),)), "cannot be right"),
        (Stated(joints=Joints(use=True)), "No joints were seen"),
        (
            Stated(joints=Joints(use=True, marked=(Mark(frame=400, pixel=(1, 1)),))),
            "400, which is not tracked",
        ),
    ],
)
def test_what_cannot_be_applied_is_refused(stated: Stated, said: str) -> None:
    with pytest.raises(InvalidCorrection, match=said):
        adjusted(stated)


@pytest.mark.parametrize(
    ("length_mm", "stated", "percent"),
    [
        (20_000, Stated(), 5.0),  # 2.2 % of a rig that was measured with a tape
        (12_000, Stated(rig_sigma=RigSigma(height_mm=0.2)), 0.5),
        (12_000, Stated(lengths=(TAPE,)), 0.5),
        (6_060, Stated(), 5.0),  # ± 0.13 m: no floor makes a narrower class of a short run
        (100_000, Stated(lengths=(known(101.0),)), 1.0),  # closure 0.99 %
        (100_000, Stated(lengths=(known(105.5),), forced="x"), None),
    ],
)
def test_half_width_and_closure_determine_the_class(
    length_mm: float, stated: Stated, percent: float | None
) -> None:
    raw = make_track(np.linspace(0, length_mm, FRAMES))
    if any(length.kind == "tape" for length in stated.lengths):
        raw = RAW
    found = adjusted(stated, raw=raw).distance_class()
    assert found is not None
    assert found.percent == percent


@given(
    rows=st.integers(1, FRAMES),
    zero=st.none() | st.integers(0, 50),
    height_mm=st.none() | st.floats(0.5, 4),
)
def test_a_run_that_goes_on_is_carried_on_exactly_without_solving(
    rows: int, zero: int | None, height_mm: float | None
) -> None:
    stated = Stated(
        zero=Zero(frame=zero, offset_m=0.4) if zero is not None and zero < rows else None,
        rig_sigma=RigSigma(height_mm=height_mm) if height_mm is not None else None,
    )
    begun = Track(**{name: getattr(RAW, name)[:rows] for name in vars(RAW)})
    early, late = adjusted(stated, raw=begun), adjusted(stated)
    carried = early.extended(RAW)
    assert carried.distance_mm == pytest.approx(late.track.distance_mm)
    assert carried.sigma_distance_mm == pytest.approx(late.track.sigma_distance_mm, abs=1e-3)
    one = early.estimate(estimate_at(RAW, FRAMES - 1))  # type: ignore[arg-type]
    assert one.distance_mm == pytest.approx(late.track.distance_mm[-1])
    assert one.sigma_distance_mm == pytest.approx(late.track.sigma_distance_mm[-1], abs=1e-3)
    assert len(since(carried, rows)) == FRAMES - rows


def test_a_track_without_rows_can_be_carried_on() -> None:
    empty = Track.from_estimates(())
    early = adjusted(Stated(rig_sigma=RigSigma(height_mm=1.0)), raw=empty)
    late = adjusted(Stated(rig_sigma=RigSigma(height_mm=1.0)))
    assert early.distance_class() is None
    assert early.chainage_mm(5.0) == 5.0
    assert early.extended(RAW).sigma_distance_mm == pytest.approx(
        late.track.sigma_distance_mm, rel=1e-6
    )


def test_a_raw_distance_is_mapped_along_the_corrected_track() -> None:
    there_and_back = np.concatenate([TRUE_MM, TRUE_MM[::-1]])
    raw = make_track(there_and_back / 1.01)
    found = adjusted(Stated(zero=Zero(frame=10, offset_m=0.25), lengths=(TAPE,)), raw=raw)
    zero_mm = TRUE_MM[10]
    for at_mm in (-500.0, 0.0, 3333.0, 12_000.0, 13_000.0):
        assert found.chainage_mm(at_mm / 1.01) == pytest.approx(at_mm - zero_mm + 250, abs=1)


def test_what_was_stated_survives_its_json() -> None:
    stated = Stated(
        zero=Zero(frame=3, offset_m=-0.2),
        lengths=(TAPE, KNOWN),
        joints=Joints(
            use=True,
            marked=(Mark(frame=5, pixel=(1.5, 2.5)),),
            left_out=(LeftOut(frame=9),),
        ),
        rig_sigma=RigSigma(height_mm=1.0, focal_px=0.5),
        forced="because",
    )
    assert Stated.from_json(stated.to_json()) == stated
    assert Stated.from_json({}) == Stated()


def clicked(frame: int, ahead_mm: float) -> Mark:
    # Over a floor 200 mm below, a pixel is 0.8 mm: image-right is ahead.
    return Mark(frame=frame, pixel=((FIELDS["camera"]["width"] - 1) / 2 + ahead_mm / 0.8, 60.0))


def test_a_joint_that_is_seen_and_clicked_on_is_one() -> None:
    seen = SEEN[2]
    marks = (clicked(seen.frame + 1, float(seen.ahead_mm - 40)),)  # 40 mm a frame
    found = adjusted(Stated(joints=Joints(use=True, marked=marks)), SEEN)
    assert [joint.number for joint in found.joints] == [1, 2, 3, 4, 5, 6, 7]
    assert [joint.is_marked for joint in found.joints].count(True) == 1
    assert found.joints[2].others == (seen.frame,)
    assert found.uncounted_marks == ()


@pytest.mark.parametrize("use", [True, None])
def test_a_click_beside_the_joints_is_named_with_its_place(use: bool | None) -> None:
    marks = (clicked(SEEN[2].frame + 15, 0.0),)  # 600 mm on
    found = adjusted(Stated(joints=Joints(use=use, marked=marks)), SEEN)
    (mark,) = found.uncounted_marks
    assert mark.frame == SEEN[2].frame + 15
    assert mark.distance_mm == pytest.approx(found.joints[2].distance_mm + 600, abs=50)


@pytest.mark.parametrize("zero_at", [0, 45, 100])
def test_the_3d_view_and_the_report_show_the_same_joints(zero_at: int) -> None:
    seen = SEEN[1]
    marks = (clicked(seen.frame + 1, float(seen.ahead_mm - 40)),)
    stated = Stated(zero=Zero(frame=zero_at), joints=Joints(use=True, marked=marks))
    found = adjusted(stated, SEEN)
    drawn = [(mark.number, mark.x_m) for mark in joint_marks(found) if mark.is_seen]
    reported = [
        (joint["number"], joint["distance_m"])
        for joint in result_of(Corrected(stated, found, None))["joints"]
        if joint["number"] >= 1  # a seam at the zero is where the pipe begins
    ]
    assert drawn == reported
    assert all(number >= 1 for number, _ in drawn)
    assert len({number for number, _ in drawn}) == len(drawn)


def test_a_segment_of_odd_length_is_counted_too() -> None:
    odd = np.array([0, 1, 2, 3, 3.4, 4.4, 5.4, 6.4])
    found = adjusted(Stated(joints=Joints(use=True)), joints_at(*(800 + SEGMENT_MM * odd)))
    numbers = [joint.number for joint in found.sighted]
    assert len(set(numbers)) == len(numbers)
