"""The contract for work elsewhere: `run(spec) -> manifest`, JSON in and JSON out.

A spec names one film of the blob store and everything that its track depends on. `run` tracks it in
a scratch folder with the code that a server uses in its own folder, puts the results into the store
under a place of their own, and returns their digests. It changes nothing else, so it may run twice
at once, or be killed at any time: another run continues from its newest checkpoint, or finds its
manifest, and the results are the same to the byte. Nothing that was put by a run counts until the
queue has accepted its manifest (`queue`).
"""

from __future__ import annotations

import hashlib
import logging
import secrets
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

import msgspec

from app.jobs import parts
from app.jobs.messages import KeptCheckpoint, Limits
from app.jobs.parts import Mark
from app.storage import keys
from app.storage.blobs import Blobs, FolderBlobs
from app.storage.files import Places
from app.storage.runs import Outcome
from app.tracking.film_run import FilmTracker
from app.tracking.journal import stamp_of
from app.tracking.live import Event, Live, Update, WallChanged
from app.tracking.runs import Run, Runs, track_metadata
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

Decoded = TypeVar("Decoded", covariant=True)

_POLL_S = 0.5
_MANIFEST, _CHECKPOINT, _JOURNAL = "manifest.json", "checkpoint", "journal"


class Spec(msgspec.Struct, frozen=True, kw_only=True):
    """What is to be tracked, and within which limits; see `TrackedFilm` for the first fields."""

    id: str
    name: str
    rig: dict[str, Any]
    video: dict[str, Any]
    source_filename: str
    source_sha256: str
    film: str
    """Key of the film in the blob store."""
    place: str
    """Key of the place under which each run makes its own."""
    marks: list[Mark] = []
    """Frames that are not in the film, and where its parts begin."""
    memory_bytes: int
    cpu_s: int | None
    stall_s: float
    """Seconds without progress after which a child process is ended."""
    checkpoint_s: float = 15.0
    """Shortest time between two checkpoints that are put into the store."""


class Stored(msgspec.Struct, frozen=True):
    """A file in the store."""

    size: int
    sha256: str

    @classmethod
    def of(cls, content: bytes) -> Stored:
        """Describe a content."""
        return cls(len(content), hashlib.sha256(content).hexdigest())


class Manifest(msgspec.Struct, frozen=True):
    """How a run ended, and its results."""

    outcome: Outcome
    frames_done: int
    fps: float | None = None
    last: Estimate | None = None
    stamp: str = ""
    """Digest of program, film and rig."""
    place: str = ""
    """Where the results are in the store; empty if they are at their place already."""
    files: dict[str, Stored] = {}
    """The results by name: track.csv, health.csv, joints.csv, and the tiles of the wall."""


class Report(msgspec.Struct, frozen=True):
    """Progress of a run."""

    frames_done: int
    fps: float | None


def run(
    spec: Mapping[str, Any],
    blobs: Blobs,
    *,
    is_stopped: Callable[[], bool] = lambda: False,
    report: Callable[[Report], None] = lambda report: None,
) -> dict[str, Any]:
    """Track the film of a spec and return the manifest.

    Args:
        spec: A `Spec` as JSON.
        blobs: The store with the film, which receives the results.
        is_stopped: Asked about twice a second; once it is true, the track ends where it is.
        report: Called with the progress, in one thread at a time.
    Returns:
        A `Manifest` as JSON. A film that cannot be tracked gives one too, with the reason.
    Raises:
        msgspec.ValidationError: The spec is invalid.
        AppError: The store or the scratch folder fails.
    """
    order = msgspec.convert(dict(spec), Spec)
    found: dict[str, Any] = msgspec.to_builtins(_found_or_run(order, blobs, is_stopped, report))
    return found


def _found_or_run(
    spec: Spec, blobs: Blobs, is_stopped: Callable[[], bool], report: Callable[[Report], None]
) -> Manifest:
    left = [blob.key for blob in blobs.listed(spec.place)]
    finished = _finished(spec, blobs, left)
    if finished is not None:
        return finished
    with tempfile.TemporaryDirectory(prefix="chainage-work-") as scratch:
        work = _Work(spec, blobs, Path(scratch))
        work.prepare(left)
        return work.run(is_stopped, report)


def _finished(spec: Spec, blobs: Blobs, left: Iterable[str]) -> Manifest | None:
    """Return the manifest of an earlier run that had the same film, rig and program."""
    stamp = stamp_of(spec)
    for key in left:
        if key.endswith(f"/{_MANIFEST}"):
            found = _decoded(msgspec.json.Decoder(Manifest), blobs.get(key))
            if found and found.stamp == stamp and found.outcome.status == "done":
                return found
    return None


class _Decoder(Protocol[Decoded]):
    def decode(self, content: bytes, /) -> Decoded: ...


def _decoded(decoder: _Decoder[Decoded], content: bytes) -> Decoded | None:
    """Decode what a run has left; None if another version of the program wrote it."""
    try:
        return decoder.decode(content)
    except msgspec.MsgspecError:
        logger.info("Results of another version are not used.")
        return None


class _Work:
    """One run in its scratch folder."""

    def __init__(self, spec: Spec, blobs: Blobs, scratch: Path) -> None:
        self._spec = spec
        self._blobs = blobs
        self._place = f"{spec.place}/{secrets.token_hex(8)}"
        self._places = Places(scratch)
        self._live = Live()
        self._results = FolderBlobs(scratch)
        self._tracks = Tracks(self._results, self._places)
        self._unrolled = Unrolled(self._results, self._live)
        self._runs = Runs(self._tracks, self._unrolled, self._live)
        self._pushed_s = time.monotonic()
        self._journal_bytes = 0
        """Bytes of the journal that are in the store."""
        self._tiles: set[int] = set()
        """Tiles that changed since they were put into the store."""

    def run(self, is_stopped: Callable[[], bool], report: Callable[[Report], None]) -> Manifest:
        spec = self._spec
        run = Run(spec)
        self._runs.add(run)
        tracker = FilmTracker(
            self._places,
            self._tracks,
            self._unrolled,
            self._runs,
            stall_s=spec.stall_s,
            on_checkpoint=self._push_if_due,
        )
        with (
            self._blobs.local(spec.film) as film,
            self._live.listening(spec.id, lambda event: self._hear(event, report)),
            _polling(is_stopped, lambda: self._runs.ask_to_stop(spec.id, "cancelled")),
        ):
            outcome = tracker.track(run, film, Limits(spec.memory_bytes, spec.cpu_s))
        assert outcome is not None  # noqa: S101  (nobody asks it to shut down)
        self._tracks.finish(spec.id, track_metadata(spec))
        return self._put_results(run, outcome)

    def _hear(self, event: Event, report: Callable[[Report], None]) -> None:
        if isinstance(event, WallChanged):
            self._tiles.update(event.indices)
        elif isinstance(event, Update):
            report(Report(event.progress.frames_done, event.progress.fps))

    def prepare(self, left: Sequence[str]) -> None:
        """Make the folder, with the newest checkpoint of the runs that left these keys."""
        inspection_id = self._spec.id
        self._places.inspection(inspection_id).mkdir(parents=True)
        if self._spec.marks:
            parts.append(self._places.marks(inspection_id), self._spec.marks)
        best = self._newest_checkpoint(left)
        if best is None:
            return
        place, kept = best
        journal = b"".join(
            self._blobs.get(key) for key in sorted(left) if key.startswith(f"{place}/{_JOURNAL}/")
        )
        self._places.journal(inspection_id).write_bytes(journal[: kept.journal_bytes])
        for key in left:
            if key.startswith(f"{place}/wall/"):
                index = int(key.rpartition("/")[2].removesuffix(".jpg"))
                self._results.put_again(keys.tile(inspection_id, index), self._blobs.get(key))
                self._tiles.add(index)
        self._places.checkpoint(inspection_id).write_bytes(msgspec.msgpack.encode(kept))

    def _newest_checkpoint(self, left: Iterable[str]) -> tuple[str, KeptCheckpoint] | None:
        stamp = stamp_of(self._spec)
        found = []
        for key in left:
            if key.endswith(f"/{_CHECKPOINT}"):
                kept = _decoded(msgspec.msgpack.Decoder(KeptCheckpoint), self._blobs.get(key))
                if kept and kept.stamp == stamp:
                    found.append((key.removesuffix(f"/{_CHECKPOINT}"), kept))
        return max(found, key=lambda each: each[1].checkpoint.frames, default=None)

    def _push_if_due(self) -> None:
        """Put the results up to the checkpoint into the store, and then the checkpoint."""
        if time.monotonic() - self._pushed_s < self._spec.checkpoint_s:
            return
        inspection_id = self._spec.id
        with self._places.journal(inspection_id).open("rb") as file:
            file.seek(self._journal_bytes)
            entries = file.read()
        self._blobs.put(f"{self._place}/{_JOURNAL}/{self._journal_bytes:012d}", entries)
        self._journal_bytes += len(entries)
        tiles, self._tiles = self._tiles, set()
        for index in sorted(tiles):
            self._blobs.put(
                f"{self._place}/wall/{index}.jpg", self._unrolled.picture(inspection_id, index)
            )
        self._blobs.put(
            f"{self._place}/{_CHECKPOINT}", self._places.checkpoint(inspection_id).read_bytes()
        )
        self._pushed_s = time.monotonic()

    def _put_results(self, run: Run, outcome: Outcome) -> Manifest:
        folder = keys.inspection(self._spec.id)
        names = ["track.csv", "health.csv", "joints.csv"]
        names += [f"wall/{tile.index}.jpg" for tile in self._unrolled.tiles(self._spec.id)]
        files = {}
        for name in names:
            content = self._results.get(f"{folder}/{name}")
            self._blobs.put(f"{self._place}/{name}", content)
            files[name] = Stored.of(content)
        manifest = Manifest(
            outcome, run.frames_done, run.fps, run.last, stamp_of(self._spec), self._place, files
        )
        self._blobs.put(f"{self._place}/{_MANIFEST}", msgspec.json.encode(manifest))
        return manifest


class _polling:  # noqa: N801  (used like a function)
    """Asks `is_stopped` in a thread of its own while the block runs; then calls `stop` once."""

    def __init__(self, is_stopped: Callable[[], bool], stop: Callable[[], object]) -> None:
        self._is_stopped = is_stopped
        self._stop = stop
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._poll, name="stop-poll", daemon=True)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _poll(self) -> None:
        while not self._ended.wait(_POLL_S):
            if self._is_stopped():
                self._stop()
                return
