"""What is kept of a run beside its poses."""

from app.services.tracks import HealthColumns
from vo_core.health import Health

SHARP, BLURRED = Health(0.9, 0.5, 0.0, 1.0, 0.0), Health(0.9, 0.5, 0.0, 0.25, 0.0)


def test_a_frame_that_was_left_out_has_the_health_of_the_next_one() -> None:
    columns = HealthColumns()
    columns.note(0, SHARP)
    columns.note(3, BLURRED)
    assert [health.sharpness for health in columns.since(0)] == [1, 0.25, 0.25, 0.25]
    columns.note(3, SHARP)  # looked at once more after a restart
    assert [health.sharpness for health in columns.since(2)] == [0.25, 0.25]


def test_health_reads_back_from_its_file() -> None:
    columns = HealthColumns()
    for frame in range(3):
        columns.note(frame, SHARP if frame else BLURRED)
    read = HealthColumns.from_csv(columns.to_csv())
    assert read.to_csv() == columns.to_csv()
    assert len(read) == 3
