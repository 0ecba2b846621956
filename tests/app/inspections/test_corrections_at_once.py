"""Two who state something about the same distances at once: nothing of it is lost."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from builders import clip_rig
from reports import track_of

from app.errors import ChangedMeanwhile
from app.inspections.corrections import Corrections
from app.inspections.counters import Counters
from app.jobs.track.batches import Batch
from app.storage.blobs.folder import FolderBlobs
from app.storage.database.database import Database
from app.storage.database.tables import Inspection
from app.storage.folder.files import DataFolder, Places
from app.storage.records.corrections import CorrectionStore, Rescaling
from app.storage.records.inspections import InspectionStore
from app.storage.records.runs import RunStore
from app.survey.distances.stated import Joints, RigSigma, Stated, Zero
from app.survey.distances.track_rows import estimate_at
from app.tracking.live import Live
from app.tracking.pictures.counter_files import CounterFiles
from app.tracking.tracks import Tracks

ID = "a" * 32
BY_ALI = Stated(rig_sigma=RigSigma(height_mm=1.0, focal_px=2.0))
ROWS = 20
RAW = track_of(1.0, ROWS)


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    folder = DataFolder(tmp_path, reserve_bytes=0)
    with closing(folder), closing(Database(folder.database)) as database:
        now = datetime.now(UTC)
        row = Inspection(
            id=ID, name="A run", status="done", rig=clip_rig(), header={}, source_kind="upload",
            source_filename="a.mp4", source_size=1, source_sha256="0" * 64, video_file="video.mp4",
            video={}, frames_done=ROWS, created_at=now, queued_at=now,
        )  # fmt: skip
        InspectionStore(database).add(row, "Ali")
        folder.inspection(ID).mkdir(parents=True)
        yield database


@pytest.fixture
def store(database: Database) -> CorrectionStore:
    return CorrectionStore(database)


@pytest.fixture
def corrections(database: Database, store: CorrectionStore, tmp_path: Path) -> Corrections:
    tracks = Tracks(FolderBlobs(tmp_path), Places(tmp_path))
    tracks.begin(ID)
    tracks.append(ID, Batch([estimate_at(RAW, n) for n in range(ROWS)]))
    inspections = InspectionStore(database)
    counters = Counters(inspections, CounterFiles(FolderBlobs(tmp_path)), tracks)
    return Corrections(inspections, store, tracks, counters, Live())


def with_zero(stated: Stated) -> Stated:
    return stated.model_copy(update={"zero": Zero(frame=3, offset_m=1.5)})


def test_what_others_state_while_one_value_is_changed_stays(corrections: Corrections) -> None:
    interrupted: list[Stated] = []

    def change(stated: Stated) -> Stated:
        if not interrupted:
            corrections.put(ID, BY_ALI, None, "Ali")
        interrupted.append(stated)
        return with_zero(stated)

    corrected = corrections.change(ID, change, None, "Meter counter")
    assert corrected.stated == with_zero(BY_ALI)
    assert corrections.get(ID).stated == with_zero(BY_ALI)
    assert interrupted == [Stated(), BY_ALI]


def test_who_is_never_fast_enough_is_refused(corrections: Corrections) -> None:
    tries: list[Stated] = []

    def change(stated: Stated) -> Stated:
        tries.append(stated)
        corrections.put(ID, Stated(rig_sigma=RigSigma(height_mm=float(len(tries)))), None, "Ali")
        return with_zero(stated)

    with pytest.raises(ChangedMeanwhile):
        corrections.change(ID, change, None, "Meter counter")
    assert len(tries) == 5
    assert corrections.get(ID).stated.zero is None


def test_a_change_of_another_version_is_refused_with_both(corrections: Corrections) -> None:
    before = corrections.get(ID)
    corrections.put(ID, BY_ALI, None, "Ali", replaced=before.version)
    with pytest.raises(ChangedMeanwhile) as refused:
        corrections.put(ID, with_zero(Stated()), None, "Siti", replaced=before.version)
    assert refused.value.current == BY_ALI.to_json()
    assert refused.value.yours == with_zero(Stated()).to_json()
    assert corrections.get(ID).stated == BY_ALI


def test_a_scale_that_was_found_does_not_hide_what_is_stated_meanwhile(
    corrections: Corrections, store: CorrectionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    corrections.newest(ID)
    rescale, off = store.rescale, Stated(joints=Joints(use=False))

    def late(inspection_id: str, change: Rescaling, revision: int) -> int | None:
        corrections.put(ID, off, None, "Ali")
        return rescale(inspection_id, change, revision)

    monkeypatch.setattr(store, "rescale", late)
    change = Rescaling("joints", None, {"scale": 1.1}, "1 joint")
    assert not corrections.rescaled(ID, change)
    assert corrections.get(ID).stated == off
    assert store.last_rescaled(ID) is None


def test_a_rig_that_is_changed_while_somebody_corrects_is_the_one_that_counts(
    corrections: Corrections,
    database: Database,
    store: CorrectionStore,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    correct, rig = store.correct, clip_rig()
    rig["mount"]["height_mm"] += 10

    def late(*given: Any, **options: Any) -> int:
        RunStore(database).change_rig(ID, "Siti", rig)
        corrections.forget(ID)
        return correct(*given, **options)

    corrections.get(ID)
    monkeypatch.setattr(store, "correct", late)
    corrections.put(ID, BY_ALI, None, "Ali")
    assert corrections.adjusted(ID).rig.mount.height_mm == rig["mount"]["height_mm"]
    assert corrections.get(ID).stated == BY_ALI
