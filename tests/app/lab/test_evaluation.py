"""The figures of `evaluate` on tracks whose errors are known by construction."""

from dataclasses import replace

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.tools import file_interface

from app.lab.evaluation import (
    Run,
    Truth,
    displacement_error,
    errors_of,
    evaluate,
    load_runs,
    plot,
)
from vo_core.errors import InvalidTrack
from vo_core.track import COLUMNS, Track


def truth_of(x_mm, y_mm=0.0, yaw_deg=0.0) -> Truth:
    x_mm = np.asarray(x_mm, float)
    zero = np.zeros_like(x_mm)
    frame = np.arange(len(x_mm))
    return Truth(frame, frame / 30, x_mm, zero + y_mm, zero + yaw_deg, x_mm)


def track_of(truth: Truth, *, sigma_mm=0.0, status="ok", **changes) -> Track:
    """A track that is right but for `changes`, whole columns."""
    zero = np.zeros(len(truth))
    columns = {
        "frame": truth.frame,
        "time_s": truth.time_s,
        "x_mm": truth.x_mm,
        "y_mm": truth.y_mm,
        "yaw_deg": truth.yaw_deg,
        "distance_mm": changes.get("x_mm", truth.x_mm),
        "sigma_distance_mm": zero + sigma_mm,
        "quality": zero + 1,
        "status": np.full(len(truth), status),
        "sigma_registration_mm": zero + sigma_mm,
        **dict.fromkeys(("z_mm", "pitch_deg", "roll_deg", "looking_around"), zero),
    }
    return Track(**{**columns, **changes})


STRAIGHT = truth_of(np.linspace(0, 6000, 601))


def test_perfect_track_has_no_error():
    result = evaluate(track_of(STRAIGHT), STRAIGHT)
    assert result.frames == 601
    assert result.missing_frames == 0
    assert result.path_mm == pytest.approx(6000)
    for name in ("end_error_mm", "max_error_mm", "ate_mm", "rpe_mm", "rpe_deg", "yaw_rms_deg"):
        assert getattr(result, name) == pytest.approx(0, abs=1e-9)
    assert result.coverage == 1
    assert result.nees is None
    rows = dict(result.rows())
    assert rows["end error"] == "+0.00 mm (+0.000 %)"
    assert rows["within 3 sigma"] == "100.0%"


def test_wrong_scale_is_not_aligned_away():
    result = evaluate(track_of(STRAIGHT, x_mm=STRAIGHT.x_mm * 1.01), STRAIGHT)
    assert result.end_error_mm == pytest.approx(60)
    assert result.end_error_percent == pytest.approx(1)
    assert result.max_error_mm == pytest.approx(60)
    assert result.ate_mm == pytest.approx(60 / np.sqrt(3), rel=0.01)
    assert result.rpe_mm == pytest.approx(5)
    assert result.mean_error_mm == pytest.approx(30)
    assert result.variance_error_mm2 == pytest.approx(result.sd_error_mm**2)


def test_error_that_cancels_at_the_end_is_still_seen_on_the_way():
    error = 8 * np.sin(np.pi * STRAIGHT.x_mm / 6000)
    result = evaluate(track_of(STRAIGHT, x_mm=STRAIGHT.x_mm + error), STRAIGHT)
    assert result.end_error_mm == pytest.approx(0, abs=1e-6)
    assert result.max_error_mm == pytest.approx(8)


def test_end_error_of_a_return_trip_is_in_percent_of_the_path():
    truth = truth_of(np.concatenate([np.linspace(0, 3000, 301), np.linspace(2990, 0, 300)]))
    result = evaluate(track_of(truth, x_mm=truth.x_mm - np.linspace(0, 6, 601)), truth)
    assert result.path_mm == pytest.approx(6000)
    assert result.end_error_percent == pytest.approx(-0.1)


def test_wrong_heading_shows_in_the_relative_error():
    drift_deg = np.linspace(0, 12, 601)  # one degree every 0.5 m
    result = evaluate(track_of(STRAIGHT, yaw_deg=drift_deg), STRAIGHT)
    assert result.rpe_deg == pytest.approx(1)
    # The motion of each step is read in axes that are turned by up to 11 degrees.
    assert result.rpe_mm > 40
    assert result.yaw_rms_deg == pytest.approx(12 / np.sqrt(3), rel=0.01)


def test_yaw_is_compared_around_the_circle():
    truth = truth_of(np.linspace(0, 100, 11), yaw_deg=179.5)
    result = evaluate(track_of(truth, yaw_deg=np.full(11, -179.5)), truth)
    assert result.yaw_rms_deg == pytest.approx(1)


def test_short_way_has_no_relative_error():
    result = evaluate(track_of(truth_of([0, 10, 20])), truth_of([0, 10, 20]))
    assert (result.rpe_mm, result.rpe_deg) == (None, None)
    assert ("RPE over 0.5 m", "path too short") in result.rows()


def test_error_is_reported_along_the_way():
    error = np.interp(STRAIGHT.x_mm, [0, 1500, 3000, 4500, 6000], [0, 1, -2, 3, 0])
    result = evaluate(track_of(STRAIGHT, x_mm=STRAIGHT.x_mm + error), STRAIGHT)
    assert result.quarter_errors_mm == pytest.approx((1, -2, 3))
    assert dict(result.rows())["distance error at 1/4, 1/2, 3/4"] == "+1.00 / -2.00 / +3.00 mm"


def test_missing_frames_are_counted_and_the_others_matched_by_number():
    whole = track_of(STRAIGHT)
    keep = np.delete(np.arange(601), [5, 6, 300])
    result = evaluate(Track(**{name: getattr(whole, name)[keep] for name in COLUMNS}), STRAIGHT)
    assert (result.missing_frames, result.surplus_frames) == (3, 0)
    assert result.max_error_mm == pytest.approx(0)


def test_frames_beyond_the_truth_are_counted_and_not_compared():
    longer = truth_of(np.linspace(0, 6100, 611))
    result = evaluate(track_of(longer), STRAIGHT)
    assert (result.missing_frames, result.surplus_frames) == (0, 10)
    assert result.end_error_mm == pytest.approx(0)


def test_honest_sigma_is_recognised():
    rng = np.random.default_rng(0)
    error = rng.normal(0, 2, 601)
    honest = evaluate(track_of(STRAIGHT, x_mm=STRAIGHT.x_mm + error, sigma_mm=2.0), STRAIGHT)
    assert honest.coverage > 0.99
    assert honest.nees == pytest.approx(1, abs=0.2)
    assert honest.error_over_sigma == pytest.approx(0.674, abs=0.1)  # median of |N(0, 1)|
    bold = evaluate(track_of(STRAIGHT, x_mm=STRAIGHT.x_mm + error, sigma_mm=0.2), STRAIGHT)
    assert bold.coverage < 0.5
    assert bold.nees == pytest.approx(100, rel=0.2)


def test_wrong_scale_is_covered_by_the_whole_sigma_and_not_by_that_of_the_registration():
    track = track_of(
        STRAIGHT,
        x_mm=STRAIGHT.x_mm * 1.01,
        sigma_distance_mm=0.01 * STRAIGHT.x_mm,
        sigma_registration_mm=np.ones(601),
    )
    result = evaluate(track, STRAIGHT)
    assert result.coverage == 1
    assert result.error_over_sigma == pytest.approx(1)
    assert result.registration_coverage == pytest.approx(0.05, abs=0.003)  # the first 300 mm
    assert result.error_over_registration == pytest.approx(30)


def test_height_and_tilt_are_compared_where_the_truth_has_them():
    known = replace(STRAIGHT, z_mm=0 * STRAIGHT.x_mm, pitch_deg=0 * STRAIGHT.x_mm)
    track = track_of(STRAIGHT, z_mm=np.full(601, -2.0), pitch_deg=np.linspace(-1, 1, 601))
    result = evaluate(track, known)
    assert result.z_rms_mm == pytest.approx(2)
    assert result.pitch_rms_deg == pytest.approx(1 / np.sqrt(3), rel=0.01)
    assert result.roll_rms_deg is None
    assert dict(result.rows())["z, pitch, roll rms"] == "2.00 mm, 0.58°, -°"


def test_lost_and_weak_frames_are_counted():
    status = np.array(["ok"] * 541 + ["weak"] * 30 + ["lost"] * 30)
    result = evaluate(track_of(STRAIGHT, status=status), STRAIGHT)
    assert (result.lost_frames, result.weak_frames) == (30, 30)


def test_errors_of_several_runs_are_put_together_frame_by_frame():
    low = errors_of(track_of(STRAIGHT, x_mm=STRAIGHT.x_mm - 1, sigma_mm=1.0), STRAIGHT)
    high = errors_of(track_of(STRAIGHT, x_mm=STRAIGHT.x_mm + 3, sigma_mm=0.5), STRAIGHT)
    both = displacement_error([low, high])
    assert both.mean_error_mm == pytest.approx(1)
    assert both.sd_error_mm == pytest.approx(2)
    assert both.variance_error_mm2 == pytest.approx(4)
    assert both.max_error_mm == pytest.approx(3)
    assert both.coverage == pytest.approx(0.5)
    assert both.nees == pytest.approx((1 + 36) / 2)


def test_truth_file_is_read_back_with_and_without_height_and_tilt():
    header = "frame,time_s,x_mm,y_mm,yaw_deg,distance_mm"
    truth = Truth.from_csv(
        f"# made by hand\n{header}\n0,0,0,0,0,0\n1,0.033333,10.5,-0.25,0.125,10.5\n"
    )
    assert truth.frame.tolist() == [0, 1]
    assert truth.y_mm.tolist() == [0, -0.25]
    assert truth.yaw_deg.tolist() == [0, 0.125]
    assert truth.z_mm is None
    whole = Truth.from_csv(
        f"{header},z_mm,pitch_deg,roll_deg\n0,0,0,0,0,0,0,0,0\n1,0.03,10,0,0,10,-1.5,0.25,-3\n"
    )
    found = (whole.z_mm[1], whole.pitch_deg[1], whole.roll_deg[1])
    assert found == (-1.5, 0.25, -3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no column"),
        ("frame,time_s,x_mm,y_mm,yaw_deg\n0,0,0,0,0\n", "distance_mm"),
        ("frame,time_s,x_mm,y_mm,yaw_deg,distance_mm\n0,0,x,0,0,0\n", "not numbers"),
        ("frame,time_s,x_mm,y_mm,yaw_deg,distance_mm\n0,0,0\n", "not numbers"),
        ("frame,time_s,x_mm,y_mm,yaw_deg,distance_mm\n", "no rows"),
    ],
)
def test_unusable_truth_is_refused_with_a_reason(text, said):
    with pytest.raises(InvalidTrack, match=said):
        Truth.from_csv(text)


@pytest.mark.parametrize(
    ("track", "said"),
    [
        (track_of(STRAIGHT, frame=STRAIGHT.frame + 1000), "no frame in common"),
        (Track.from_estimates([]), "no rows"),
        (track_of(STRAIGHT, x_mm=np.where(STRAIGHT.frame == 7, np.nan, 0)), "not a finite number"),
    ],
)
def test_a_track_that_cannot_be_compared_is_refused(track, said):
    with pytest.raises(InvalidTrack, match=said):
        evaluate(track, STRAIGHT)


def written(folder, name, track) -> tuple:
    """Track and truth of `STRAIGHT` as files."""
    folder.mkdir(exist_ok=True)
    track_file, truth_file = folder / name, folder / "truth.csv"
    track_file.write_text(track.to_csv(), encoding="utf-8")
    columns = {name: column for name, column in vars(STRAIGHT).items() if column is not None}
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(str, row)) for row in rows)]
    truth_file.write_text("\n".join(lines), encoding="utf-8")
    return track_file, truth_file


def test_runs_have_the_names_of_their_files_and_where_these_are_equal_of_their_folders(tmp_path):
    pairs = [written(tmp_path / day, "track.csv", track_of(STRAIGHT)) for day in ("mon", "tue")]
    assert [run.name for run in load_runs(pairs[:1])] == ["track"]
    names = [run.name for run in load_runs(pairs)]
    assert names == [str(tmp_path / day / "track") for day in ("mon", "tue")]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "bad.csv is empty"),
        (b"\x00\xff\xfe\x9c", "bad.csv is not a text file"),
        (b"frame,time_s\n0,0\n", "bad.csv: The track has no column"),
        (track_of(truth_of([0.0])).to_csv().splitlines()[0].encode(), "The track holds no rows"),
        (track_of(replace(STRAIGHT, frame=STRAIGHT.frame + 700)).to_csv().encode(), "700 to 1300"),
    ],
)
def test_file_that_does_not_fit_is_named_with_the_reason(tmp_path, content, said):
    bad, truth = written(tmp_path, "bad.csv", track_of(STRAIGHT))
    bad.write_bytes(content)
    with pytest.raises(InvalidTrack, match=said) as refused:
        load_runs([(bad, truth)])
    assert str(bad) in str(refused.value)


def test_evo_reads_the_track_and_finds_the_same_errors(tmp_path):
    angle = np.linspace(0, 2, 301)
    truth = truth_of(3000 * np.sin(angle), 3000 * (1 - np.cos(angle)), np.degrees(angle))
    rng = np.random.default_rng(5)
    track = track_of(
        truth,
        x_mm=truth.x_mm * 1.01 + rng.normal(0, 2, 301),
        y_mm=truth.y_mm + 4,
        yaw_deg=truth.yaw_deg + 3 * np.sin(angle),
    )
    for name, poses in (("truth", track_of(truth)), ("track", track)):
        (tmp_path / name).write_text(poses.to_tum(), encoding="utf-8")
    theirs, ours = (
        file_interface.read_tum_trajectory_file(str(tmp_path / name)) for name in ("truth", "track")
    )

    assert ours.timestamps == pytest.approx(track.time_s, abs=1e-6)
    forward = np.array([pose[:3, 0] for pose in ours.poses_se3])  # robot x in the world
    yaw_rad = np.radians(track.yaw_deg)
    expected = np.column_stack([np.cos(yaw_rad), np.sin(yaw_rad), np.zeros(301)])
    assert forward == pytest.approx(expected, abs=1e-8)

    def ape(relation):
        error = metrics.APE(relation)
        error.process_data(sync.associate_trajectories(theirs, ours))
        return error.get_statistic(metrics.StatisticsType.rmse)

    result = evaluate(track, truth)
    assert 1000 * ape(metrics.PoseRelation.translation_part) == pytest.approx(result.ate_mm)
    assert ape(metrics.PoseRelation.rotation_angle_deg) == pytest.approx(result.yaw_rms_deg)


@pytest.mark.parametrize(("count", "rows"), [(1, 1), (3, 4)])
def test_plot_draws_a_row_for_each_run_and_one_for_all(tmp_path, count, rows):
    noisy = track_of(STRAIGHT, x_mm=STRAIGHT.x_mm + 1, sigma_mm=1.0)
    plot([Run(f"run {n}", noisy, STRAIGHT) for n in range(count)], tmp_path / "runs.png")
    data = (tmp_path / "runs.png").read_bytes()
    assert data.startswith(b"\x89PNG")
    width, height = (int.from_bytes(data[at : at + 4]) for at in (16, 20))
    assert height == pytest.approx(rows * 3.4 / 11 * width, abs=2)
