"""What people are shown where picture and rig disagree, on tracks of which the truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import clip_rig
from reports import track_of
from textures import make_rig

from app.lab.simulation import SCENARIOS, Scenario, render
from app.survey.adjustment.adjust import adjust
from app.survey.adjustment.adjusted_track import Adjusted
from app.survey.distances.corrected import Corrected, result_of
from app.survey.distances.notices import notices_of
from app.survey.distances.stated import Stated
from vo_core import Odometry, Rig, Track
from vo_core.geometry.tilt import MountTilt
from vo_core.joints.sightings import Sighting

SEGMENT_MM = 1500.0
RAW = track_of(12.0)
FIELDS = clip_rig()
RIG = Rig.parse(FIELDS | {"pipe": {"shape": "flat", "segment_length_mm": SEGMENT_MM}})


def adjusted(at_mm: np.ndarray, raw: Track = RAW) -> Adjusted:
    """By joints that were seen there, in the raw track."""
    frames = np.searchsorted(RAW.distance_mm, at_mm) - 1
    seen = [
        Sighting(int(frame), float(at - RAW.distance_mm[frame]), 0.3, 0.5)
        for frame, at in zip(frames, at_mm, strict=True)
    ]
    return adjust(raw, RIG, Stated(), seen)


@pytest.mark.parametrize("scale", [0.99, 1.0, 1.015])
def test_nothing_is_said_within_the_tolerance(scale: float) -> None:
    found = adjusted(SEGMENT_MM / scale * np.arange(1, 8))
    assert found.source == "joint"
    assert notices_of(found) == []


def test_a_camera_that_must_sit_elsewhere_is_named_with_its_height() -> None:
    (notice,) = notices_of(adjusted(SEGMENT_MM / 0.93 * np.arange(1, 7)))
    assert notice.code == "height_doubted"
    assert notice.params["scale"] == pytest.approx(0.93, abs=0.005)
    assert notice.params["height_mm"] == pytest.approx(0.93 * 200, abs=1)
    assert (notice.params["stated_mm"], notice.params["tolerance_mm"]) == (200.0, 2.0)


def test_a_stated_length_of_a_segment_that_is_wrong_does_not_set_the_scale() -> None:
    found = adjusted(SEGMENT_MM / 0.75 * np.arange(1, 6))
    assert (found.source, found.scale) == ("odometry", 1.0)
    (notice,) = notices_of(found)
    assert notice.code == "joints_doubted"
    assert notice.params == {"scale": pytest.approx(0.75, abs=0.005), "segment_mm": SEGMENT_MM}


def test_rings_that_lie_otherwise_than_stated_are_named() -> None:
    (notice,) = notices_of(adjusted(np.array([1000.0, 2900.0, 4750.0, 6950.0, 8100.0])))
    assert notice.code == "rings_uncounted"
    assert notice.params == {"n": 5, "segment_mm": SEGMENT_MM}


PIPE = {"shape": "circular", "diameter_mm": 400.0}
WAVES = {"pitch_mm": 67.7, "depth_mm": 13.0}


def corrugated(pitch_mm: float, **pipe: object) -> Adjusted:
    """By crests that are that far apart in the raw track, in the pipe of a rig."""
    seen = [
        Sighting(frame, pitch_mm * 7 * n - float(RAW.distance_mm[frame]), 0.5, 0.7, pitch_mm)
        for n, frame in enumerate(range(50, len(RAW), 20))
    ]
    return adjust(RAW, Rig.parse(FIELDS | {"pipe": PIPE | pipe}), Stated(), seen)


def test_waves_that_the_rig_does_not_state_are_asked_for() -> None:
    (notice,) = notices_of(corrugated(67.0))
    assert (notice.code, notice.params) == ("waves_unstated", {"pitch_mm": 67.0})


def test_crests_of_a_stated_pitch_set_the_scale() -> None:
    found = corrugated(67.0, corrugation=WAVES)
    assert notices_of(found) == []
    assert found.scale == pytest.approx(67.7 / 67.0, abs=0.002)
    said = result_of(Corrected(Stated(), found, None))
    assert said is not None
    assert said["by_joints"]["of"] == "crests"
    assert said["joints"] == []


def test_a_stated_pitch_that_neither_picture_nor_rig_explains_is_not_used() -> None:
    found = corrugated(67.7, corrugation=WAVES | {"pitch_mm": 76.2})
    assert found.scale == pytest.approx(1.0)
    (notice,) = notices_of(found)
    assert notice.code == "pitch_doubted"
    assert notice.params == {"seen_mm": pytest.approx(67.7, abs=0.2), "pitch_mm": 76.2}


def test_two_joints_alone_do_not_overrule_the_rig() -> None:
    two, three = (adjusted(SEGMENT_MM / 0.9 * np.arange(1, n + 1)) for n in (2, 3))
    assert (two.source, three.source) == ("odometry", "joint")
    assert [notice.code for notice in notices_of(two)] == ["joints_doubted"]
    assert three.scale == pytest.approx(0.9, abs=0.005)


def test_a_scale_that_changes_along_the_run_is_named() -> None:
    scales = np.linspace(1.0, 0.88, 8)  # a bed of silt that rises
    (notice,) = notices_of(adjusted(np.cumsum(SEGMENT_MM / scales)[:7]))
    assert notice.code == "scale_changes"
    assert notice.params["least"] == pytest.approx(0.88, abs=0.02)
    assert notice.params["greatest"] == pytest.approx(1.0, abs=0.02)


def test_a_bed_that_joints_find_to_change_nothing_is_not_named() -> None:
    """The wall of this run shows a bed in parts, but every segment is as long as stated."""
    at_mm = RAW.distance_mm
    own_mm, bed_mm = 1 + 0.005 * at_mm, 0.01 * np.clip(at_mm - 4000, 0, 6000)
    sigma_mm = np.sqrt(own_mm**2 + (0.002 * at_mm) ** 2 + bed_mm**2)
    shown = replace(RAW, sigma_registration_mm=own_mm, sigma_distance_mm=sigma_mm)
    joints = SEGMENT_MM * np.arange(1, 7)
    corrected = adjusted(joints, raw=shown)
    assert corrected.correction is not None
    assert len(corrected.correction.stretches) > 1
    assert notices_of(corrected) == []
    assert "changes along the run" not in str(corrected.by_joints)


FORWARD = make_rig(mount={"view": "forward", "height_mm": 150.0, "roll_deg": 1.0})


def turned(rig: Rig, tilt: MountTilt) -> list[tuple[str, dict[str, float]]]:
    found = notices_of(adjust(RAW, rig, Stated(), []), tilt)
    return [(notice.code, notice.params) for notice in found]


def test_a_tilt_counts_beyond_two_sigma_of_tolerance_and_measurement_together() -> None:
    assert turned(make_rig(), MountTilt(1.9, -1.9, 0.01, 0.01)) == []
    assert turned(make_rig(), MountTilt(2.9, 0.0, 1.1, 0.0)) == []
    assert turned(make_rig(), MountTilt(2.9, 0.0, 0.1, 0.0)) == [
        ("looks_ahead", {"turned_deg": 2.9, "tolerance_deg": 1.0, "seen_deg": 2.9})
    ]
    known = make_rig().known_to(tilt_deg=0.2)
    ((code, params),) = turned(known, MountTilt(0.1, -0.6, 0.01, 0.1))
    assert (code, params["tolerance_deg"]) == ("looks_right", 0.2)


def test_a_camera_that_looks_along_the_pipe_turns_otherwise() -> None:
    assert turned(FORWARD, MountTilt(-2.5, 2.5, 0.1, 0.1)) == [
        ("looks_down", {"turned_deg": 2.5, "tolerance_deg": 1.0, "seen_deg": -2.5})
    ]


def tilt_of(scenario: Scenario) -> MountTilt:
    odometry = Odometry(scenario.rig)
    for frame in render(scenario):
        odometry.step(frame.image, frame.t_s)
    return odometry.tilt


def mounted(name: str, **mount: float) -> Scenario:
    scenario = SCENARIOS[name].shortened(150.0)
    rig = scenario.rig
    true = rig.model_copy(update={"mount": rig.mount.model_copy(update=mount)})
    return replace(scenario, true_rig=true, seed=5)


def test_a_tilted_mount_is_named_from_its_pictures_and_its_rig_is_put_right() -> None:
    scenario = mounted("nominal", pitch_deg=-3.5)
    ((code, params),) = turned(scenario.rig, tilt_of(scenario))
    assert (code, params["seen_deg"]) == ("looks_back", -3.5)

    floor = mounted("tiled_floor", roll_deg=3.0)
    ((code, params),) = turned(floor.rig, tilt_of(floor))
    assert (code, params["seen_deg"]) == ("looks_left", pytest.approx(3.0, abs=0.21))
    assert turned(floor.rendered_rig, tilt_of(replace(floor, rig=floor.rendered_rig))) == []


def test_a_robot_that_nods_on_soft_wheels_has_no_tilted_mount() -> None:
    scenario = replace(SCENARIOS["bounce"].shortened(300.0), seed=6)
    assert turned(scenario.rig, tilt_of(scenario)) == []
