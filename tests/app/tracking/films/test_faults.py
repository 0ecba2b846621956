"""A few rounds of what `tests/measure/faults.py` does two hundred times."""

from pathlib import Path

import pytest
from measure.faults import Storm


@pytest.mark.long
def test_nothing_acknowledged_is_lost_when_processes_are_killed(tmp_path: Path) -> None:
    tally = Storm(tmp_path, seed=2).run(30)
    assert tally.server_kills > 0
    assert tally.tracker_kills + tally.media_kills > 0
    assert tally.acknowledged_tags > 0
    assert tally.acknowledged_pieces > 0
    assert tally.faults == 0, tally
