"""Joints bring a run to scale while it drives; what that moved stands in the record."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from builders import clip_rig, wait_until
from reports import track_of

from app.inspections.corrections import Corrections
from app.inspections.counters import Counters
from app.inspections.scaling import Scaling
from app.jobs.track.batches import Batch
from app.storage.blobs.folder import FolderBlobs
from app.storage.database.database import Database
from app.storage.database.tables import Inspection
from app.storage.folder.files import DataFolder
from app.storage.records.corrections import CorrectionStore
from app.storage.records.inspections import InspectionStore
from app.storage.records.runs import Outcome, RunStore
from app.survey.distances.stated import Joints, Stated
from app.survey.distances.track_rows import estimate_at
from app.survey.observations.records import CHAINAGE, RESCALED
from app.tracking.live import DistancesCorrected, Event, Live, Progress, Update
from app.tracking.pictures.counter_files import CounterFiles
from app.tracking.tracks import Tracks
from vo_core.joints.sightings import Sighting

ID = "a" * 32
SEGMENT_MM, TRUE_SCALE, ROWS = 1500.0, 0.992, 400
RAW = track_of(12.0, ROWS)
AT_MM = SEGMENT_MM / TRUE_SCALE * np.arange(1, 8)
"""Joints in the raw track."""


@dataclass
class Bench:
    """The services of a run, and the events that they publish."""

    inspections: InspectionStore
    runs: RunStore
    store: CorrectionStore
    tracks: Tracks
    corrections: Corrections
    live: Live
    heard: list[Event]

    def drive_to(self, frame: int, state: str = "running") -> None:
        """The run arrives there, and shows the joints on its way."""
        begin = len(self.tracks.get(ID))
        estimates = tuple(estimate_at(RAW, n) for n in range(begin, frame))
        frames = np.searchsorted(RAW.distance_mm, AT_MM) - 1
        seen = [
            Sighting(int(n), float(at - RAW.distance_mm[n]), 0.3, 0.5)
            for n, at in zip(frames, AT_MM, strict=True)
            if begin <= n < frame
        ]
        self.tracks.append(ID, Batch(list(estimates), sightings=seen))
        self.live.publish(Update(ID, state, Progress(frame, ROWS, None, None), estimates))

    def end(self) -> None:
        """It is done."""
        self.tracks.finish(ID, {})
        self.runs.record_outcome(ID, Outcome("done"), frames_done=ROWS, fps=None, last=None)
        self.live.publish(Update(ID, "done", Progress(ROWS, ROWS, None, None)))

    def rescaled(self) -> list[dict[str, object]]:
        """What the record has of it, the oldest first."""
        events = self.inspections.events(ID)
        assert {event.who for event in events if event.action == RESCALED} <= {CHAINAGE}
        return [
            {"before": event.before, "after": event.after, "remark": event.remark}
            for event in events
            if event.action == RESCALED
        ]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    rig = clip_rig()
    rig["pipe"]["segment_length_mm"] = SEGMENT_MM
    folder = DataFolder(tmp_path, reserve_bytes=0)
    with closing(folder), closing(Database(folder.database)) as database:
        inspections, store = InspectionStore(database), CorrectionStore(database)
        live, tracks = Live(), Tracks(FolderBlobs(folder.root), folder)
        counters = Counters(inspections, CounterFiles(FolderBlobs(folder.root)), tracks)
        corrections = Corrections(inspections, store, tracks, counters, live)
        scaling = Scaling(store, tracks, corrections)
        now = datetime.now(UTC)
        row = Inspection(
            id=ID, name="A run", status="running", rig=rig, header={}, source_kind="upload",
            source_filename="a.mp4", source_size=1, source_sha256="0" * 64, video_file="video.mp4",
            video={}, frames_done=0, created_at=now, queued_at=now,
        )  # fmt: skip
        inspections.add(row, "Ali")
        folder.inspection(ID).mkdir(parents=True)
        tracks.begin(ID)
        heard: list[Event] = []
        with live.listening(None, scaling.on_event), live.listening(ID, heard.append):
            scaling.start()
            yield Bench(inspections, RunStore(database), store, tracks, corrections, live, heard)
            scaling.stop()


def test_joints_that_come_into_sight_scale_the_run_once_and_it_is_recorded(bench: Bench) -> None:
    bench.drive_to(ROWS // 2)
    (found,) = wait_until(bench.rescaled)
    assert found["before"] is None
    assert found["after"]["scale"] == pytest.approx(TRUE_SCALE, abs=0.002)
    assert found["after"]["joints_counted"] == 3
    assert found["after"]["camera_lower_mm"] == pytest.approx(0.008 * 200, abs=0.5)
    assert str(found["remark"]).startswith("3 joints: scale 0.99")
    page = Path(__file__).parents[3] / "static"
    words = json.loads((page / "words/en.json").read_text("utf-8"))
    assert found["after"].keys() <= words["history"]["field"].keys()  # the page names each
    # It is told after the record has it.
    wait_until(lambda: any(isinstance(event, DistancesCorrected) for event in bench.heard))
    assert bench.corrections.revision(ID) == 1
    reported = bench.corrections.estimate(ID, estimate_at(RAW, ROWS // 2 - 1))
    assert reported.distance_mm == pytest.approx(
        TRUE_SCALE * RAW.distance_mm[ROWS // 2 - 1], abs=20
    )

    bench.drive_to(ROWS)
    bench.end()
    wait_until(lambda: bench.corrections.newest(ID).joints[-1].number == 7)
    assert len(bench.rescaled()) == 1, "the same scale again is no news"


def test_what_a_person_says_of_joints_holds(bench: Bench) -> None:
    bench.drive_to(ROWS // 2)
    wait_until(bench.rescaled)
    off = Stated(joints=Joints(use=False))
    assert bench.corrections.put(ID, off, "they are rings of dirt", "Ali").adjusted.scale == 1.0
    bench.drive_to(ROWS)
    bench.end()
    assert bench.corrections.adjusted(ID).source == "odometry"
    bench.corrections.put(ID, Stated(), None, "Ali")
    assert bench.corrections.adjusted(ID).source == "joint"
    assert len(bench.rescaled()) == 1


def test_after_a_restart_it_is_not_recorded_again(bench: Bench) -> None:
    bench.drive_to(ROWS // 2)
    wait_until(bench.rescaled)
    again = Scaling(bench.store, bench.tracks, bench.corrections)
    with bench.live.listening(None, again.on_event):
        again.start()
        bench.drive_to(ROWS)
        bench.end()
        again.stop()
    assert len(bench.rescaled()) == 1
