"""What is kept of a run beside its poses."""

from pathlib import Path

from app.storage.files import Places
from app.tracking.tracks import HealthColumns, Tracks
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health

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


def test_the_newest_tilt_of_the_mount_is_kept_with_the_track(tmp_path: Path) -> None:
    tracks, tilt = Tracks(Places(tmp_path)), MountTilt(2.9, -0.25, 0.01, 0.4)
    Places(tmp_path).inspection("a").mkdir(parents=True)
    tracks.begin("a")
    assert tracks.tilt("a") is None
    tracks.note("a", (), (), MountTilt(0.0, 0.0, 1.0, 1.0))
    tracks.note("a", (), (), tilt)
    tracks.note("a", (), ())
    assert tracks.tilt("a") == tilt
    tracks.finish("a", {"name": "A run"})
    tracks.finish("a", {"name": "A run"})  # once more, as after a full disk
    assert Tracks(Places(tmp_path)).tilt("a") == tilt
    tracks.begin("a")
    assert tracks.tilt("a") is None
