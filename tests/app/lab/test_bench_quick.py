"""The comparison of `chainage bench --quick` with the recorded figures, on made-up rows."""

import pytest

from app.lab.bench import quick, recorded
from app.lab.bench.recorded import FIGURES, changes
from app.lab.bench.sequences import SEQUENCES
from app.lab.simulation.motion import Trajectory

ROW = {
    "end_percent": -0.01, "worst_mm": 0.4, "ate_mm": 0.3, "yaw_deg": 0.1, "y_mm": 0.2,
    "within": 1.0, "within_registration": 0.98, "registration_mm": 0.3, "lost": 0.0,
    "joints": 2.0, "time_ratio": 1.0,
}  # fmt: skip
WORSE = {
    "end_percent": 0.08, "worst_mm": 2.0, "ate_mm": 1.5, "yaw_deg": 0.3, "y_mm": 1.1,
    "within": 0.9, "within_registration": 0.7, "registration_mm": 1.0, "lost": 5.0,
    "joints": 0.0,
}  # fmt: skip


@pytest.fixture
def bench(chainage, monkeypatch, tmp_path):
    """Run `bench --quick` where these rows are recorded and those are measured."""

    def run(before, now, *options):
        monkeypatch.setattr(quick, "RECORD", tmp_path / "bench_quick.csv")
        monkeypatch.setattr(quick, "measure", lambda draws, report: now)
        recorded.write(quick.RECORD, before)
        return chainage("bench", "--quick", *options)

    return run


def test_equal_rows_pass(bench):
    done = bench({"nominal": [ROW], "dim": [ROW]}, {"nominal": [ROW], "dim": [ROW]})
    assert done.code == 0
    assert "Worse" not in done.out
    assert "Better" not in done.out


@pytest.mark.parametrize("figure", WORSE)
def test_row_that_is_worse_is_named_with_its_figures_before_and_now_and_fails(bench, figure):
    now = ROW | {figure: WORSE[figure]}
    done = bench({"nominal": [ROW], "dim": [ROW]}, {"nominal": [ROW], "dim": [now]})
    assert done.code == 1
    named = done.out[done.out.index("Worse") :].strip().splitlines()[-1]
    form = FIGURES[figure].form
    for words in ("dim", FIGURES[figure].heading, f"{ROW[figure]:{form}} -> {now[figure]:{form}}"):
        assert words in named


@pytest.mark.parametrize("figure", WORSE)
def test_row_that_is_better_is_listed_and_passes(bench, figure):
    before = ROW | {figure: WORSE[figure]}
    done = bench({"nominal": [before]}, {"nominal": [ROW]})
    assert done.code == 0
    assert "Better" in done.out
    assert "Worse" not in done.out


def test_slower_step_is_listed_and_passes(bench):
    done = bench({"nominal": [ROW]}, {"nominal": [ROW | {"time_ratio": 1.9}]})
    assert done.code == 0
    assert "Slower" in done.out
    assert "1.00 -> 1.90" in done.out


def test_last_digits_and_the_sign_of_an_error_are_noise():
    now = ROW | {"end_percent": 0.015, "worst_mm": 0.45, "yaw_deg": 0.11, "lost": 1.0}
    assert list(changes({"nominal": [ROW]}, {"nominal": [now]})) == []


def test_large_errors_have_a_share_of_noise():
    lost = ROW | {"end_percent": -30.0, "worst_mm": 900.0}
    near, far = lost | {"end_percent": -33.0}, lost | {"end_percent": -45.0}
    assert list(changes({"fast_turns": [lost]}, {"fast_turns": [near]})) == []
    assert [one.figure for one in changes({"fast_turns": [lost]}, {"fast_turns": [far]})] == [
        "end_percent"
    ]


def test_row_that_chance_moves_as_far_is_not_worse():
    draws = [ROW | {"yaw_deg": yaw_deg} for yaw_deg in (0.1, 0.3, 0.2)]
    for yaw_deg, found in ((0.45, []), (0.7, ["dim: yaw (°) 0.100 (0.100 to 0.300) -> 0.700"])):
        changed = changes({"dim": draws}, {"dim": [ROW | {"yaw_deg": yaw_deg}]})
        assert [str(one) for one in changed] == found


def test_recorded_rows_are_read_as_they_were_measured(bench, monkeypatch, tmp_path):
    readme = tmp_path / "README.md"
    readme.write_text("<!-- bench-quick:begin -->\n<!-- bench-quick:end -->\n")
    monkeypatch.setattr(quick, "_README", readme)
    now = dict.fromkeys(SEQUENCES, 2 * [ROW | {"joints": None, "yaw_deg": 0.1234}])
    assert bench({}, now, "--record").code == 0
    assert recorded.read(quick.RECORD) == now
    assert "| nominal | -0.010 |" in readme.read_text()


def test_every_sequence_is_recorded_with_every_figure():
    record = recorded.read(quick.RECORD)
    assert list(record) == list(SEQUENCES)
    for draws in record.values():
        assert [list(row) for row in draws] == quick.DRAWS * [list(FIGURES)]


def test_sequences_are_short():
    frames = {name: Trajectory(one).frames for name, one in SEQUENCES.items()}
    assert max(frames.values()) <= 300
    assert sum(frames.values()) < 9000
