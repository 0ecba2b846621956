"""What is kept of a run until its last checkpoint, and when it is not used."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from builders import clip_rig

from app.jobs.messages import encode
from app.jobs.track.batches import Batch, WallPicture
from app.jobs.track.messages import Checkpoint, KeptCheckpoint
from app.storage.blobs.folder import FolderBlobs
from app.storage.database.tables import Inspection
from app.storage.folder.files import DataFolder
from app.tracking.films.journal import Journal
from app.tracking.live import Live
from app.tracking.unrolled import Unrolled
from vo_core import Estimate
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting

ID = "0123456789abcdef" * 2


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[DataFolder]:
    opened = DataFolder(tmp_path, reserve_bytes=0)
    opened.inspection(ID).mkdir()
    yield opened
    opened.close()


def journal(folder: DataFolder, *, sha256: str = "5", focal_px: float = 250.0) -> Journal:
    inspection = Inspection(id=ID, rig=clip_rig(fx=focal_px), source_sha256=sha256)
    return Journal(folder, Unrolled(FolderBlobs(folder.root), Live()), inspection)


def batch(frame: int) -> Batch:
    estimate = Estimate(frame, 0.1 * frame, frame / 3, 0.1, 0.2, frame / 3, 0.01, 0.9, "ok", 0.01)
    return Batch(
        [estimate],
        b"picture",
        health=[(frame, Health(0.9, 0.5, 0.0, 1.0, 0.0))],
        tiles=[WallPicture(0, b"tile")],
        sightings=[Sighting(frame, 1 / 3, 0.1, -0.2)],
    )


def kept(folder: DataFolder) -> Journal:
    """Two checkpoints, the second after three frames, and a frame that came after it."""
    of_run = journal(folder)
    assert of_run.read() is None
    for frame, is_checkpoint in enumerate((True, False, True, False)):
        of_run.note(batch(frame))
        if is_checkpoint:
            of_run.keep(Checkpoint(frame + 1, 1.5, b"state"))
    return of_run


def test_all_until_the_checkpoint_comes_back_as_it_was_without_its_pictures(
    folder: DataFolder,
) -> None:
    kept(folder)
    resumption = journal(folder).read()
    assert resumption is not None
    assert (resumption.frames, resumption.cpu_s) == (3, 1.5)
    wanted = [msgspec.structs.replace(batch(n), jpeg=b"", tiles=[]) for n in range(3)]
    assert resumption.found == wanted


def test_what_goes_on_is_kept_behind_the_checkpoint_and_not_behind_what_was_lost(
    folder: DataFolder,
) -> None:
    kept(folder)
    with folder.journal(ID).open("ab") as file:
        file.write(b"half an entry")
    of_next = journal(folder)
    assert of_next.read() is not None
    of_next.note(batch(3))
    of_next.keep(Checkpoint(4, 2.0, b"state"))
    resumption = journal(folder).read()
    assert resumption is not None
    assert [one.frame for each in resumption.found for one in each.estimates] == [0, 1, 2, 3]


@pytest.mark.parametrize("other", [{"sha256": "6"}, {"focal_px": 251.0}])
def test_another_video_or_rig_has_no_use_for_it(folder: DataFolder, other: dict[str, str]) -> None:
    kept(folder)
    assert journal(folder, **other).read() is None


def test_another_version_of_the_program_has_no_use_for_it(folder: DataFolder) -> None:
    kept(folder)
    path = folder.checkpoint(ID)
    of_another = msgspec.msgpack.decode(path.read_bytes(), type=KeptCheckpoint)
    path.write_bytes(encode(msgspec.structs.replace(of_another, stamp="of another")))
    assert journal(folder).read() is None


@pytest.mark.parametrize("name", ["checkpoint", "journal"])
def test_what_is_damaged_or_gone_is_not_used(folder: DataFolder, name: str) -> None:
    kept(folder)
    path = folder.inspection(ID) / name
    path.write_bytes(path.read_bytes()[:-20] if name == "checkpoint" else path.read_bytes()[:-150])
    assert journal(folder).read() is None
    path.unlink()
    assert journal(folder).read() is None


def test_without_room_the_checkpoint_before_holds_and_the_next_one_has_all(
    folder: DataFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    of_run = kept(folder)
    with monkeypatch.context() as full:
        full.setattr("app.tracking.films.journal.write_durably", raise_no_room)
        of_run.keep(Checkpoint(4, 2.0, b"state"))
    resumption = journal(folder).read()
    assert resumption is not None
    assert resumption.frames == 3
    of_run.note(batch(4))
    of_run.keep(Checkpoint(5, 2.5, b"state"))
    resumption = journal(folder).read()
    assert resumption is not None
    assert resumption.frames == len(resumption.found) == 5


def raise_no_room(*_: object) -> None:
    raise OSError(28, "No space left on device")


def test_nothing_is_left_when_the_run_has_ended(folder: DataFolder) -> None:
    kept(folder).drop()
    assert list(folder.inspection(ID).iterdir()) == []
