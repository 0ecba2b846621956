"""What is kept of a run beside its poses."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from builders import PATIENCE_S

from app.errors import DamagedTrack
from app.jobs.track.batches import Batch
from app.storage.blobs.folder import FolderBlobs
from app.storage.folder.files import Places
from app.tracking.tracks import HealthColumns, Tracks
from vo_core.geometry.initial_pose import InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting
from vo_core.track import Estimate, Track

SHARP, BLURRED = Health(0.9, 0.5, 0.0, 1.0, 0.0), Health(0.9, 0.5, 0.0, 0.25, 0.0)


@pytest.fixture
def tracks(tmp_path: Path) -> Tracks:
    Places(tmp_path).inspection("a").mkdir(parents=True)
    return started(tmp_path)


def started(tmp_path: Path) -> Tracks:
    """As another server finds them."""
    return Tracks(FolderBlobs(tmp_path), Places(tmp_path))


def test_a_frame_that_was_left_out_has_the_health_of_the_next_one() -> None:
    columns = HealthColumns()
    columns.note(0, SHARP)
    columns.note(3, BLURRED)
    assert columns.columns()["sharpness"].tolist() == [1, 0.25, 0.25, 0.25]
    columns.note(3, SHARP)  # looked at once more after a restart
    assert columns.columns()["sharpness"][2:].tolist() == [0.25, 0.25]
    assert HealthColumns.from_csv(columns.to_csv()).to_csv() == columns.to_csv()


def test_the_newest_tilt_and_stance_of_the_camera_are_kept_with_the_track(
    tracks: Tracks, tmp_path: Path
) -> None:
    tilt, initial_pose = (
        MountTilt(2.9, -0.25, 0.01, 0.4),
        InitialPose(12.0, -0.5, 16.25, -3.125, 0.0),
    )
    tracks.begin("a")
    assert (tracks.tilt("a"), tracks.initial_pose("a")) == (None, InitialPose())
    tracks.append(
        "a", Batch([], tilt=MountTilt(0.0, 0.0, 1.0, 1.0), initial_pose=InitialPose(y_mm=1.0))
    )
    tracks.append("a", Batch([], tilt=tilt, initial_pose=initial_pose))
    tracks.append("a", Batch([]))
    for _ in range(2):  # once more, as after a full disk
        tracks.finish("a", {"name": "A run"})
        for found in (tracks, started(tmp_path)):
            assert (found.tilt("a"), found.initial_pose("a")) == (tilt, initial_pose)
    tracks.go_on("a")
    assert tracks.initial_pose("a") == initial_pose
    tracks.begin("a")
    assert tracks.tilt("a") is None
    tracks.finish("a", {"name": "A run"})
    assert "# stance" not in FolderBlobs(tmp_path).get("inspections/a/track.csv").decode()
    assert started(tmp_path).initial_pose("a") == InitialPose()


def test_a_track_that_grows_is_read_without_a_copy_and_what_was_read_stays(tracks: Tracks) -> None:
    tracks.begin("a")
    tracks.append("a", Batch(estimates(0, 200)))
    read = tracks.get("a")
    assert np.shares_memory(read.distance_mm, tracks.get("a").distance_mm)
    tracks.append("a", Batch(estimates(200, 1000)))
    assert len(read) == 200
    assert len(tracks.get("a")) == 1000
    assert read.distance_mm.tolist() == tracks.get("a").distance_mm[:200].tolist()
    with pytest.raises(ValueError, match="read-only"):
        read.distance_mm[0] = 1.0


def test_a_track_that_goes_on_leaves_what_was_read_before_as_it_is(tracks: Tracks) -> None:
    tracks.begin("a")
    tracks.append("a", Batch(estimates(0, 3), health=[(2, SHARP)]))
    tracks.finish("a", {})
    track, health = tracks.get("a"), tracks.health("a")
    tracks.go_on("a")
    tracks.append("a", Batch(estimates(3, 5), health=[(4, BLURRED)]))
    assert (len(track), len(health)) == (3, 3)
    assert tracks.get("a").frame.tolist() == [0, 1, 2, 3, 4]
    assert tracks.health("a").columns()["sharpness"][2:].tolist() == [1, 0.25, 0.25]


def moved(rows: list[Estimate], by_mm: float) -> list[Estimate]:
    return [replace(row, distance_mm=row.distance_mm + by_mm) for row in rows]


def test_smoothed_rows_replace_the_live_ones_at_once_when_the_run_is_stored(
    tracks: Tracks, tmp_path: Path
) -> None:
    live = estimates(0, 9)
    tracks.begin("a")
    tracks.append("a", Batch(live, sightings=[Sighting(4, 1.0, 0.1, 0.2)]))
    run = tracks.run_id("a")
    for batch in (live[:5], live[5:]):
        assert tracks.moved_mm("a") is None
        tracks.append("a", Batch([], smoothed=moved(batch, 3.0)))
        assert (tracks.get("a").distance_mm == [row.distance_mm for row in live]).all()
    moved_mm = tracks.moved_mm("a")
    assert moved_mm is not None
    assert moved_mm == pytest.approx(np.full(9, 3.0))
    assert tracks.run_id("a") == run
    tracks.finish("a", {})
    assert tracks.run_id("a") != run, "a page reads all rows again"
    for found in (tracks, started(tmp_path)):
        assert found.get("a").distance_mm[[0, 8]].tolist() == [3.0, 43.0]
    assert ",24.0000\n" in FolderBlobs(tmp_path).get("inspections/a/joints.csv").decode()


def test_a_process_that_dies_while_it_sends_smoothed_rows_leaves_the_live_ones(
    tracks: Tracks,
) -> None:
    live = estimates(0, 9)
    for is_whole in (False, True):  # the second one has gone on from the checkpoint
        tracks.begin("a")
        tracks.append("a", Batch(live))
        tracks.append("a", Batch([], smoothed=moved(live[: None if is_whole else 8], 3.0)))
        assert (tracks.moved_mm("a") is not None) == is_whole
        tracks.finish("a", {})
        assert tracks.get("a").distance_mm[0] == (3.0 if is_whole else 0.0)


def test_a_recording_that_goes_on_keeps_the_rows_before_it_when_the_rest_is_smoothed(
    tracks: Tracks,
) -> None:
    tracks.begin("a")
    tracks.append("a", Batch(estimates(0, 3)))
    tracks.finish("a", {})
    tracks.go_on("a")
    tracks.append("a", Batch(estimates(3, 5)))
    tracks.append("a", Batch([], smoothed=moved(estimates(3, 5), 3.0)))
    tracks.finish("a", {})
    assert tracks.get("a").distance_mm.tolist() == [0.0, 5.0, 10.0, 18.0, 23.0]


@pytest.mark.parametrize(
    "damage",
    [
        lambda sound: sound[:-9],
        lambda sound: sound.replace(b"\n4,", b"\nfour,"),
        lambda _: b"",
        lambda sound: sound.replace(b"frame,", b"picture,"),
        lambda _: bytes(range(256)),
        lambda _: bytes(999),
        lambda _: None,
    ],
    ids=["cut off", "text", "empty", "other columns", "garbage", "zeros", "missing"],
)
def test_a_damaged_file_is_named_with_its_repair(
    tracks: Tracks, tmp_path: Path, damage: Callable[[bytes], bytes | None]
) -> None:
    tracks.begin("a")
    tracks.append(
        "a", Batch(estimates(0, 9), health=[(8, SHARP)], sightings=[Sighting(4, 1.0, 0.1, 0.2)])
    )
    tracks.finish("a", {})
    file = tmp_path / "inspections" / "a" / "track.csv"
    damaged = damage(file.read_bytes())
    file.unlink() if damaged is None else file.write_bytes(damaged)
    with pytest.raises(DamagedTrack, match=r"is damaged: .+\. Track the film again"):
        tracks.get("a")
    file.with_name("joints.csv").write_bytes(bytes(99))
    with pytest.raises(DamagedTrack, match="Track the film again"):
        tracks.sightings("a")


def test_who_reads_while_a_run_is_stored_or_dropped_finds_no_damage(tmp_path: Path) -> None:
    class ReadMeanwhile(FolderBlobs):
        """A store in which another server reads after each change."""

        def put(self, key: str, content: bytes) -> None:
            super().put(key, content)
            assert len(started(tmp_path).get("a")) in (0, 9)

        def delete(self, key: str) -> None:
            super().delete(key)
            assert len(started(tmp_path).get("a")) in (0, 9)

    tracks = Tracks(ReadMeanwhile(tmp_path), Places(tmp_path))
    Places(tmp_path).inspection("a").mkdir(parents=True)
    for _ in range(2):
        tracks.begin("a")
        tracks.append("a", Batch(estimates(0, 9), health=[(8, SHARP)]))
        tracks.finish("a", {})


def test_a_run_that_was_still_being_read_does_not_replace_the_one_after_it(
    tracks: Tracks, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_read, may_return = Event(), Event()
    tracks.begin("a")
    tracks.append("a", Batch(estimates(0, 3)))
    tracks.finish("a", {})
    from_csv = Track.from_csv

    def slowly(text: str) -> Track:
        track = from_csv(text)
        is_read.set()
        may_return.wait(PATIENCE_S)
        return track

    monkeypatch.setattr(Track, "from_csv", slowly)
    with ThreadPoolExecutor(1) as pool:
        old = pool.submit(tracks.get, "a")
        is_read.wait(PATIENCE_S)
        monkeypatch.setattr(Track, "from_csv", from_csv)
        tracks.begin("a")
        tracks.append("a", Batch(estimates(0, 5)))
        tracks.finish("a", {})
        may_return.set()
        assert len(old.result()) == 3
    assert len(tracks.get("a")) == 5


def test_every_run_has_an_id_of_its_own_also_after_a_restart(tmp_path: Path) -> None:
    ids = []
    for _ in range(2):
        tracks = started(tmp_path)
        ids.append(tracks.run_id("a"))
        for _ in range(2):
            tracks.begin("a")
            ids.append(tracks.run_id("a"))
            tracks.append("a", Batch(estimates(0, 3)))
            assert tracks.run_id("a") == ids[-1]
    assert len(set(ids)) == len(ids)


def test_tracks_that_are_kept_in_memory_are_bounded_by_their_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.tracking.tracks.FRAMES_KEPT", 2500)
    tracks = started(tmp_path)
    for name in ("a", "b", "c"):
        Places(tmp_path).inspection(name).mkdir(parents=True)
        tracks.begin(name)
        tracks.append(name, Batch(estimates(0, 1200)))
        tracks.finish(name, {})
    read = {name: tracks.get(name) for name in ("a", "b", "c")}
    assert tracks.get("c") is read["c"]
    assert tracks.get("b") is read["b"]
    assert tracks.get("a") is not read["a"]


def estimates(first: int, end: int) -> list[Estimate]:
    return [
        Estimate(n, n / 25, 5.0 * n, 0.0, 0.0, 5.0 * n, 1.0, 0.9, "weak", 1.0)
        for n in range(first, end)
    ]
