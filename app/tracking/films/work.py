"""The contract for work elsewhere: `run(spec) -> manifest`, both of them JSON.

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
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TypeVar

import msgspec

from app.jobs.messages import Limits
from app.jobs.process import Child, ask_about_media
from app.jobs.track import parts
from app.jobs.track.batches import Batch, WallPicture, batches_of
from app.jobs.track.chunks import gather, join
from app.jobs.track.messages import FrameRange, JoinWallsRequest, KeptCheckpoint
from app.jobs.track.parts import Mark
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.blobs.folder import FolderBlobs
from app.storage.folder.files import Places
from app.storage.folder.temporary import temporary_folder
from app.storage.records.runs import Outcome
from app.tracker import tracker
from app.tracking.films.film_run import FilmTracker
from app.tracking.films.journal import stamp_of
from app.tracking.films.runs import Run, Runs, TrackedFilm, track_metadata
from app.tracking.live import Event, Live, Update, WallChanged
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from vo_core import Rig
from vo_core.errors import UndeterminedSeam
from vo_core.track import Estimate

logger = logging.getLogger(__name__)

Decoded = TypeVar("Decoded")

_POLL_S = 0.5
_MANIFEST, _CHECKPOINT, _JOURNAL, _PARTS = "manifest.json", "checkpoint", "journal", "journal-parts"
_SCRATCH = "chainage-work-"
LAYERS = "layers"
"""Folder of the pictures of a chunk's own wall."""


class Stored(msgspec.Struct, frozen=True):
    """A file in the store."""

    size: int
    sha256: str

    @classmethod
    def described(cls, content: bytes) -> Stored:
        """Describe a content."""
        return cls(len(content), hashlib.sha256(content).hexdigest())


class Manifest(msgspec.Struct, frozen=True):
    """How a run ended, and its results."""

    outcome: Outcome
    frames_done: int
    fps: float | None = None
    last: Estimate | None = None
    tracked_with: str | None = None
    """Program of the machine that tracked it, as `app.tracker` names it."""
    stamp: str = ""
    """Digest of program, film and rig."""
    place: str = ""
    """Where the results are in the store; empty if they are at their place already."""
    files: dict[str, Stored] = {}
    """The results by name: track.csv, health.csv, joints.csv, and the tiles of the wall; of a chunk
    the batches of its tracker, and the layers of its wall."""
    frames: FrameRange | None = None
    """Of a chunk: its frames."""
    seam: int | None = None
    """The chunk that cannot be joined with the next one; see `chunks.mended`."""
    lacks: list[str] = []
    """What the chunks after it must be told of the film."""

    @property
    def is_whole(self) -> bool:
        """Whether the film, or the chunk, was tracked to its end."""
        return self.outcome.status == "done"


class Spec(TrackedFilm, frozen=True, kw_only=True):
    """What is to be tracked, and within which limits."""

    film: str
    """Key of the film in the blob store."""
    place: str
    """Key of the place under which each run makes its own."""
    marks: list[Mark] = msgspec.field(default_factory=list)
    """Frames that are not in the film, and where its parts begin."""
    memory_bytes: int
    cpu_s: int | None
    stall_s: float
    """Seconds without progress after which a child process is ended."""
    checkpoint_s: float = 15.0
    """Shortest time between two checkpoints that are put into the store."""
    frames: FrameRange | None = None
    """The frames of a chunk, whose results can only be joined; None for the whole film."""
    joins: list[Manifest] = msgspec.field(default_factory=list)
    """The chunks of the film in their order, to be joined; then nothing is tracked."""


class Report(msgspec.Struct, frozen=True):
    """Progress of a run."""

    frames_done: int
    fps: float | None


IsStopped = Callable[[], bool]
OnReport = Callable[[Report], None]


def run(
    spec: Spec,
    blobs: Blobs,
    *,
    is_stopped: IsStopped = lambda: False,
    report: OnReport = lambda report: None,
) -> Manifest:
    """Track the film of a spec, a chunk of it, or join its chunks.

    Args:
        spec: What is to be done.
        blobs: The store with the film, which receives the results.
        is_stopped: Asked about twice a second; once it is true, the track ends where it is.
        report: Called with the progress, in one thread at a time.
    Returns:
        The results. A film that cannot be tracked gives a manifest too, with the reason.
    Raises:
        AppError: The store, the scratch folder or the join of the walls fails.
    """
    left = [blob.key for blob in blobs.listed(spec.place)]
    finished = _finished(spec, blobs, left)
    if finished is not None:
        return finished
    with temporary_folder(_SCRATCH) as scratch:
        work = _Work(spec, blobs, scratch)
        if spec.joins:
            return work.join()
        work.prepare(left)
        return work.track(is_stopped, report)


def _finished(spec: Spec, blobs: Blobs, left: Iterable[str]) -> Manifest | None:
    """Return the manifest of an earlier run that had the same film, rig and program."""
    stamp = stamp_of(spec)
    for key in left:
        if key.endswith(f"/{_MANIFEST}"):
            found = _decoded(msgspec.json.Decoder(Manifest).decode, blobs.get(key))
            if found and found.stamp == stamp and found.frames == spec.frames and found.is_whole:
                return found
    return None


def _decoded(decode: Callable[[bytes], Decoded], content: bytes) -> Decoded | None:
    """Decode what a run has left; None if another version of the program wrote it."""
    try:
        return decode(content)
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
        self._folder = self._places.inspection(spec.id)
        self._live = Live()
        results = FolderBlobs(scratch)
        self._tracks = Tracks(results, self._places)
        self._unrolled = Unrolled(results, self._live)
        if spec.marks:
            results.put(keys.marks(spec.id), parts.text_of(spec.marks).encode())
        self._runs = Runs(self._tracks, self._unrolled, self._live)
        self._pushed_s = time.monotonic()
        self._journal_bytes = 0
        """Bytes of the journal that are in the store."""
        self._painted: set[str] = set()
        """Names of pictures of the wall that changed since they were put into the store."""
        self._folder.mkdir(parents=True)

    def track(self, is_stopped: IsStopped, report: OnReport) -> Manifest:
        """Track the film, or a chunk of it."""
        spec = self._spec
        run = Run(spec, frames=spec.frames)
        self._runs.add(run)
        tracker = FilmTracker(
            self._places,
            self._runs,
            stall_s=spec.stall_s,
            on_batch=self._take_layers,
            on_checkpoint=self._push_if_due,
        )
        with (
            self._blobs.local(spec.film) as film,
            self._live.listening(spec.id, lambda event: self._hear(event, report)),
            polling(is_stopped, lambda: self._runs.ask_to_stop(spec.id, "cancelled")),
        ):
            outcome = tracker.track(run, film, Limits(spec.memory_bytes, spec.cpu_s))
        assert outcome is not None  # noqa: S101  (nobody asks it to shut down)
        if spec.frames is None:
            return self._put_results(run, outcome)
        self._push()  # a longer chunk continues from the last checkpoint
        names = [_JOURNAL, *(f"{LAYERS}/{path.name}" for path in self._layers())]
        return self._put(run, outcome, names)

    def join(self) -> Manifest:
        """Join the results of the chunks."""
        spec = self._spec
        layers = [self._folder / f"{LAYERS}-{number}" for number in range(len(spec.joins))]
        found = []
        for chunk, folder in zip(spec.joins, layers, strict=True):
            assert chunk.frames is not None  # noqa: S101  (every chunk states them)
            journal = self._blobs.get(f"{chunk.place}/{_JOURNAL}")
            batches = batches_of(BytesIO(journal), len(journal))
            found.append(gather(chunk.frames, batches))
            folder.mkdir()
            for name in chunk.files:
                if name.startswith(f"{LAYERS}/"):
                    content = self._blobs.get(f"{chunk.place}/{name}")
                    (folder / name.rpartition("/")[2]).write_bytes(content)
        run = Run(spec)
        self._runs.add(run)
        self._runs.begin(run)
        try:
            joined = join(found, Rig.parse(spec.rig))
        except UndeterminedSeam as open_one:
            outcome = Outcome("failed", "undetermined_seam", str(open_one))
            return Manifest(outcome, 0, seam=open_one.part, lacks=list(open_one.lacks))
        self._runs.take(run, joined.batch)
        limits = Limits(spec.memory_bytes, spec.cpu_s)
        request = JoinWallsRequest(
            [str(folder) for folder in layers[: len(joined.placed)]],
            joined.placed,
            spec.rig,
            limits,
        )

        def take(tile: WallPicture) -> None:
            self._unrolled.take(spec.id, [tile])

        with Child("app.jobs.track.wall_joiner") as child:
            ask_about_media(
                child,
                request,
                type(None),
                work="Joining the unrolled wall",
                stall_s=spec.stall_s,
                part=WallPicture,
                on_part=take,
            )
        return self._put_results(run, _outcome_of(spec.joins))

    def _hear(self, event: Event, report: OnReport) -> None:
        if isinstance(event, WallChanged):
            self._painted.update(f"wall/{index}.jpg" for index in event.indices)
        elif isinstance(event, Update):
            report(Report(event.progress.frames_done, event.progress.fps))

    def _take_layers(self, batch: Batch) -> None:
        """Write the finished pictures of a chunk's own wall."""
        for layer in batch.layers:
            name = f"{LAYERS}/{layer.index}.png"
            path = self._folder / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(layer.content)
            self._painted.add(name)

    def _layers(self) -> list[Path]:
        folder = self._folder / LAYERS
        return sorted(folder.iterdir()) if folder.exists() else []

    def prepare(self, left: Sequence[str]) -> None:
        """Take over the newest checkpoint of the runs that left these keys."""
        best = self._newest_checkpoint(left)
        if best is None:
            return
        place, kept = best
        journal = b"".join(
            self._blobs.get(key) for key in sorted(left) if key.startswith(f"{place}/{_PARTS}/")
        )
        self._places.journal(self._spec.id).write_bytes(journal[: kept.journal_bytes])
        for key in left:
            name = key.removeprefix(f"{place}/")
            if name.startswith(("wall/", f"{LAYERS}/")):
                path = self._folder / name
                path.parent.mkdir(exist_ok=True)
                path.write_bytes(self._blobs.get(key))
                self._painted.add(name)
        checkpoint = self._places.checkpoint(self._spec.id)
        checkpoint.write_bytes(msgspec.msgpack.encode(kept))

    def _newest_checkpoint(self, left: Iterable[str]) -> tuple[str, KeptCheckpoint] | None:
        stamp = stamp_of(self._spec)
        found = []
        for key in left:
            if key.endswith(f"/{_CHECKPOINT}"):
                kept = _decoded(
                    msgspec.msgpack.Decoder(KeptCheckpoint).decode, self._blobs.get(key)
                )
                if kept and kept.stamp == stamp and self._is_within(kept.checkpoint.frames):
                    found.append((key.removesuffix(f"/{_CHECKPOINT}"), kept))
        return max(found, key=lambda each: each[1].checkpoint.frames, default=None)

    def _is_within(self, frame: int) -> bool:
        frames = self._spec.frames
        return frames is None or frames.end is None or frame <= frames.end

    def _push_if_due(self) -> None:
        if time.monotonic() - self._pushed_s >= self._spec.checkpoint_s:
            self._push()

    def _push(self) -> None:
        """Put the results up to the checkpoint into the store, and then the checkpoint."""
        checkpoint = self._places.checkpoint(self._spec.id)
        if not checkpoint.exists():
            return
        with self._places.journal(self._spec.id).open("rb") as file:
            file.seek(self._journal_bytes)
            entries = file.read()
        self._blobs.put(f"{self._place}/{_PARTS}/{self._journal_bytes:012d}", entries)
        self._journal_bytes += len(entries)
        painted, self._painted = self._painted, set()
        for name in sorted(painted):
            self._blobs.put(f"{self._place}/{name}", (self._folder / name).read_bytes())
        self._blobs.put(f"{self._place}/{_CHECKPOINT}", checkpoint.read_bytes())
        self._pushed_s = time.monotonic()

    def _put_results(self, run: Run, outcome: Outcome) -> Manifest:
        """Put the results of the whole film into the store."""
        self._tracks.finish(self._spec.id, track_metadata(self._spec))
        names = ["track.csv", "health.csv", "joints.csv"]
        names += [f"wall/{tile.index}.jpg" for tile in self._unrolled.tiles(self._spec.id)]
        return self._put(run, outcome, names)

    def _put(self, run: Run, outcome: Outcome, names: Iterable[str]) -> Manifest:
        """Put files into the store, and then the manifest that names them."""
        files = {}
        for name in names:
            content = (self._folder / name).read_bytes()
            self._blobs.put(f"{self._place}/{name}", content)
            files[name] = Stored.described(content)
        manifest = Manifest(
            outcome,
            run.frames_done,
            run.fps,
            run.last,
            tracker(),
            stamp_of(self._spec),
            self._place,
            files,
            self._spec.frames,
        )
        self._blobs.put(f"{self._place}/{_MANIFEST}", msgspec.json.encode(manifest))
        return manifest


def _outcome_of(chunks: Sequence[Manifest]) -> Outcome:
    """Return how the film as a whole ended: as the first chunk that is not whole."""
    outcome = next((each.outcome for each in chunks if not each.is_whole), chunks[-1].outcome)
    warnings = dict.fromkeys(each.outcome.warning for each in chunks if each.outcome.warning)
    return replace(outcome, warning=" ".join(warnings) or None)


class polling:  # noqa: N801  (used like a function)
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
