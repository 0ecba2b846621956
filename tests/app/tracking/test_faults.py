"""Ten rounds of what `measure/faults.py` does two hundred times."""

from pathlib import Path

from measure.faults import Storm


def test_nothing_acknowledged_is_lost_when_processes_are_killed(tmp_path: Path) -> None:
    tally = Storm(tmp_path, seed=182).run(10)  # kills the server three times, and each worker
    assert tally.server_kills == 3
    assert tally.tracker_kills + tally.camera_kills + tally.media_kills >= 3
    assert tally.acknowledged_tags > 0
    assert tally.acknowledged_pieces > 0
    assert tally.tracks_compared > 0
    assert tally.faults == 0, tally
