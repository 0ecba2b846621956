"""The figures of `evaluate` on tracks whose errors are known by construction."""

import numpy as np
import pytest

from app.evaluation import Truth, evaluate, plot
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


def test_missing_frames_are_counted_and_the_others_matched_by_number():
    whole = track_of(STRAIGHT)
    keep = np.delete(np.arange(601), [5, 6, 300])
    result = evaluate(Track(**{name: getattr(whole, name)[keep] for name in COLUMNS}), STRAIGHT)
    assert result.missing_frames == 3
    assert result.max_error_mm == pytest.approx(0)


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


def test_lost_and_weak_frames_are_counted():
    status = np.array(["ok"] * 541 + ["weak"] * 30 + ["lost"] * 30)
    result = evaluate(track_of(STRAIGHT, status=status), STRAIGHT)
    assert result.lost_share == result.weak_share == pytest.approx(30 / 601)


def test_truth_file_is_read_back():
    truth = Truth.from_csv(
        "# made by hand\nframe,time_s,x_mm,y_mm,yaw_deg,distance_mm\n"
        "0,0,0,0,0,0\n1,0.033333,10.5,-0.25,0.125,10.5\n"
    )
    assert truth.frame.tolist() == [0, 1]
    assert truth.y_mm.tolist() == [0, -0.25]
    assert truth.yaw_deg.tolist() == [0, 0.125]


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


def test_track_and_truth_of_different_runs_are_refused():
    with pytest.raises(InvalidTrack, match="no frame in common"):
        evaluate(track_of(STRAIGHT, frame=STRAIGHT.frame + 1000), STRAIGHT)


def test_rows_name_every_figure_in_text():
    rows = dict(evaluate(track_of(STRAIGHT, sigma_mm=1.0), STRAIGHT).rows())
    assert rows["end error"] == "+0.00 mm (+0.000 %)"
    assert rows["within 3 sigma"] == "100.0%"
    assert all(isinstance(value, str) and value for value in rows.values())


def test_plot_draws_a_row_for_each_run(tmp_path):
    noisy = track_of(STRAIGHT, x_mm=STRAIGHT.x_mm + 1, sigma_mm=1.0)
    heights = []
    for count in (1, 2):
        file = tmp_path / f"{count}.png"
        plot([(f"run {n}", noisy, STRAIGHT) for n in range(count)], file)
        data = file.read_bytes()
        assert data.startswith(b"\x89PNG")
        heights.append(int.from_bytes(data[20:24]))
    assert heights[1] == pytest.approx(2 * heights[0], abs=2)
