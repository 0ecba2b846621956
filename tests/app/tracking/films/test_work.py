"""`run(spec) -> manifest`: the same results as the server's own, to the byte, however it goes."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import pytest
from builders import clip_rig, make_clip, serving, wait_until

from app.storage.blobs.folder import FolderBlobs
from app.tracking.films.work import Report, Spec, run

FRAMES = 300
MIB = 2**20
RUN = """
import msgspec, sys
from pathlib import Path
from app.storage.blobs.folder import FolderBlobs
from app.tracking.films.work import Spec, run
run(msgspec.json.decode(sys.argv[1], type=Spec), FolderBlobs(Path(sys.argv[2])))
"""


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_clip(tmp_path_factory.mktemp("film") / "film.mp4", FRAMES)


@pytest.fixture(scope="module")
def served(film: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, bytes]]:
    """Id of an inspection that a server has tracked by itself, and the files of its results."""
    with serving(tmp_path_factory.mktemp("served")) as client:
        inspection_id = client.tracked(film)
        folder = client.data / "inspections" / inspection_id
        paths = [folder / f"{name}.csv" for name in ("track", "health", "joints")]
        paths += (folder / "wall").iterdir()
        return inspection_id, {
            path.relative_to(folder).as_posix(): path.read_bytes() for path in paths
        }


@pytest.fixture
def blobs(tmp_path: Path, film: Path) -> FolderBlobs:
    """A store with the film."""
    store = FolderBlobs(tmp_path / "store")
    store.put_file("films/film.mp4", film)
    return store


def spec(inspection_id: str, film: Path, **changed: Any) -> dict[str, Any]:
    return {
        "id": inspection_id,
        "name": "Culvert 7",
        "rig": clip_rig(),
        "video": {"frames": FRAMES},
        "source_filename": film.name,
        "source_sha256": hashlib.sha256(film.read_bytes()).hexdigest(),
        "film": "films/film.mp4",
        "place": "runs/7",
        "memory_bytes": 1536 * MIB,
        "cpu_s": 600,
        "stall_s": 60.0,
        "checkpoint_s": 0.0,
    } | changed


def ran(given: Mapping[str, Any], blobs: FolderBlobs, **more: Any) -> dict[str, Any]:
    """Run a spec; it and the manifest pass through JSON."""
    order = msgspec.json.decode(json.dumps(given), type=Spec)
    found: dict[str, Any] = json.loads(msgspec.json.encode(run(order, blobs, **more)))
    return found


def results(blobs: FolderBlobs, manifest: Mapping[str, Any]) -> dict[str, bytes]:
    """The files that a manifest names, as their digests say."""
    found = {name: blobs.get(f"{manifest['place']}/{name}") for name in manifest["files"]}
    for name, content in found.items():
        stated = manifest["files"][name]
        assert (stated["size"], stated["sha256"]) == (
            len(content),
            hashlib.sha256(content).hexdigest(),
        )
    return found


def test_a_run_that_is_killed_is_continued_by_another(
    blobs: FolderBlobs,
    film: Path,
    served: tuple[str, dict[str, bytes]],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    inspection_id, files = served
    given = spec(inspection_id, film)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    killed = subprocess.Popen(
        [sys.executable, "-c", RUN, json.dumps(given), str(tmp_path / "store")],
        env=os.environ | {"TMPDIR": str(scratch)},
    )
    place = tmp_path / "store" / "runs" / "7"
    wait_until(lambda: any(place.glob("*/checkpoint")))
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert any(scratch.iterdir())
    with caplog.at_level("INFO", "app.tracking.films.film_run"):
        manifest = ran(given, blobs)
    (message,) = [record.getMessage() for record in caplog.records if "on." in record.msg]
    assert not message.endswith("from frame 0 on.")
    assert not any(scratch.iterdir())
    assert results(blobs, manifest) == files


def test_a_stopped_run_keeps_its_track_and_the_next_gives_the_servers_own_results(
    blobs: FolderBlobs, film: Path, served: tuple[str, dict[str, bytes]]
) -> None:
    inspection_id, files = served
    done: list[int] = []
    given = spec(inspection_id, film)
    manifest = ran(
        given,
        blobs,
        is_stopped=lambda: bool(done),
        report=lambda report: done.append(report.frames_done) if report.frames_done else None,
    )
    assert manifest["outcome"]["status"] == "cancelled"
    assert 0 < manifest["frames_done"] < FRAMES
    track = results(blobs, manifest)["track.csv"].decode()
    rows = [line for line in track.splitlines() if line[0].isdigit()]
    assert len(rows) == manifest["frames_done"]
    # It is no result: the next run is not stopped by it.
    reports: list[Report] = []
    manifest = ran(given, blobs, report=reports.append)
    assert manifest["outcome"]["status"] == "done"
    assert manifest["frames_done"] == reports[-1].frames_done == FRAMES
    assert results(blobs, manifest) == files
    # Whoever asks again, having lost the answer, gets it without the work.
    again: list[Report] = []
    assert ran(given, blobs, report=again.append) == manifest
    assert again == []
    # With another rig it is another work.
    ran(spec(inspection_id, film, rig=clip_rig(fx=260.0)), blobs,
        is_stopped=lambda: bool(again), report=again.append)  # fmt: skip
    assert again


def test_a_film_that_cannot_be_tracked_is_a_result_too(blobs: FolderBlobs, film: Path) -> None:
    blobs.put("films/film.mp4", b"no film")
    outcome = ran(spec(32 * "a", film), blobs)["outcome"]
    assert (outcome["status"], outcome["error_code"]) == ("failed", "unreadable_video")
