"""What runs of films are given, and what they leave until an inspection has its results."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from app.errors import BlobNotFound, WorkerLost
from app.jobs.messages import Limits
from app.jobs.track.messages import FrameRange
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.folder.files import Places
from app.tracking.films.runs import Run, track_metadata
from app.tracking.films.work import Manifest, Spec, Stored
from app.tracking.tracks import Tracks

_WHOLE, _JOINED, _PLAN = "whole", "joined", "plan.json"


class RunFiles:
    """Makes the specs of runs, brings their results to their place, and deletes what is left."""

    def __init__(
        self, folder: Places, blobs: Blobs, tracks: Tracks, *, limits: Limits, stall_s: float
    ) -> None:
        """Use these places.

        Args:
            folder: Where the pool keeps journals and checkpoints.
            blobs, tracks: For the results.
            limits, stall_s: Of each run.
        """
        self._folder = folder
        self._blobs = blobs
        self._tracks = tracks
        self._limits = limits
        self._stall_s = stall_s

    def spec(self, run: Run) -> Spec:
        """Return the spec of the whole film of a run."""
        inspection_id = run.inspection.id
        return Spec(
            **msgspec.structs.asdict(run.inspection),
            film=run.film,
            place=_place(inspection_id, _WHOLE),
            marks=self._tracks.marks(inspection_id),
            memory_bytes=self._limits.memory_bytes,
            cpu_s=self._limits.cpu_s,
            stall_s=self._stall_s,
        )

    def spec_of_chunk(self, run: Run, frames: FrameRange) -> Spec:
        """Return the spec of a chunk of the film."""
        place = _place(run.inspection.id, frames.name)
        return msgspec.structs.replace(self.spec(run), frames=frames, place=place)

    def spec_of_join(self, run: Run, chunks: Sequence[Manifest]) -> Spec:
        """Return the spec that joins these chunks of the film."""
        place = _place(run.inspection.id, _JOINED)
        return msgspec.structs.replace(self.spec(run), joins=list(chunks), place=place)

    def plan(self, run: Run) -> list[FrameRange] | None:
        """Return the chunks that an interrupted run of the film had; None if it had none."""
        try:
            kept = self._blobs.get(_place(run.inspection.id, _PLAN))
        except BlobNotFound:
            return None
        return msgspec.json.decode(kept, type=list[FrameRange])

    def keep_plan(self, run: Run, ranges: Sequence[FrameRange]) -> None:
        """Keep the chunks of a film."""
        self._blobs.put(_place(run.inspection.id, _PLAN), msgspec.json.encode(ranges))

    def drop_plan(self, run: Run) -> None:
        """Delete the chunks of a film that is tracked as a whole after all."""
        self._blobs.delete(_place(run.inspection.id, _PLAN))

    def settle(self, run: Run, manifest: Manifest) -> None:
        """Bring the results to their place; may be called again.

        Raises:
            WorkerLost: A file is not what the manifest says.
            DiskFull: There is no room for it.
        """
        inspection = run.inspection
        if not manifest.place:
            self._tracks.finish(inspection.id, track_metadata(inspection))
            return
        for name, stored in manifest.files.items():
            content = self._blobs.get(f"{manifest.place}/{name}")
            if Stored.described(content) != stored:
                raise WorkerLost(f"{name} of inspection {inspection.id} is damaged in the store.")
            self._blobs.put(f"{keys.inspection(inspection.id)}/{name}", content)
        self._tracks.forget(inspection.id)

    def drop(self, inspection_id: str) -> None:
        """Delete what is left of earlier runs: nothing is to be continued."""
        self._blobs.delete_all(keys.runs(inspection_id))
        self._folder.checkpoint(inspection_id).unlink(missing_ok=True)
        self._folder.journal(inspection_id).unlink(missing_ok=True)


def _place(inspection_id: str, name: str) -> str:
    return f"{keys.runs(inspection_id)}/{name}"
