"""What probably made the distances of a film useless, and what repairs it."""

from __future__ import annotations

from typing import Any

from app.lab.simulation import SCENARIOS
from app.survey.distances.causes import AxisSeen, Cause, causes_of, of_error
from app.survey.distances.film_quality import FilmQuality
from vo_core import Rig

NOT_SEEN = AxisSeen(looked_at=12, sure=0)


def rig(name: str = "forward", **camera_and_mount: Any) -> Rig:
    stated = SCENARIOS[name].rig.model_dump(mode="json")
    for path, value in camera_and_mount.items():
        part, field = path.split("__")
        stated[part][field] = value
    return Rig.parse(stated)


def quality(**shares: float) -> FilmQuality:
    none = dict.fromkeys(
        ("weak", "lost", "too_fast", "dark", "overexposed", "blurred", "dirty_lens"), 0.0
    )
    return FilmQuality(frames=100, **{f"{name}_share": x for name, x in {**none, **shares}.items()})


def test_pictures_that_look_along_the_pipe_contradict_a_rig_that_looks_down() -> None:
    cause, *_ = causes_of(rig("nominal"), AxisSeen(12, 9), quality(), None)
    assert cause == Cause("looks_along", "axis", {"sure": 9, "looked_at": 12})


def test_an_axis_elsewhere_says_both_angles() -> None:
    seen = AxisSeen(12, 9, pitch_deg=0.4, u95_deg=2.0)
    cause, *_ = causes_of(rig(mount__pitch_deg=23.0), seen, quality(), "tilt")
    assert cause == Cause("axis_elsewhere", "axis", {"stated_deg": 23.0, "seen_deg": 0.4})
    fits = causes_of(rig(mount__pitch_deg=3.0), seen, quality(), None)
    assert [each.code for each in fits] == ["unknown"]


def test_a_lens_that_no_inspection_camera_has_is_doubted() -> None:
    narrow = rig(camera__fx=9000.0, camera__fy=9000.0)
    cause, *_ = causes_of(narrow, AxisSeen(12, 9, 0.0, 2.0), quality(), None)
    assert cause == Cause("sees_little", "lens", {"view_deg": 4.1})


def test_the_pictures_are_at_fault_where_nothing_else_is() -> None:
    causes = causes_of(rig(), NOT_SEEN, quality(dark=0.3, blurred=0.6), "focal")
    assert [cause.code for cause in causes] == ["blurred", "too_dark", "no_axis", "focal"]
    assert [cause.repair for cause in causes] == [None, None, "axis", "lens"]


def test_a_tilt_that_no_picture_confirms_is_doubted() -> None:
    (cause,) = causes_of(rig(mount__pitch_deg=23.0), NOT_SEEN, quality(), None)
    assert cause == Cause("tilted", "axis", {"stated_deg": 23.0})


def test_a_failure_names_its_repair_and_else_another_try() -> None:
    assert of_error("no_wall_in_view").repair == "axis"
    assert of_error("rig_video_mismatch").repair == "lens"
    assert of_error("unreadable_video").repair == "film"
    assert of_error("tracking_stalled").repair == "again"
