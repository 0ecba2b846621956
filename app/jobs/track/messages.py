"""What a tracking process and its parent send each other, beside `batches`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import msgspec

from app.jobs.messages import Limits
from app.jobs.track.parts import Mark

if TYPE_CHECKING:
    from vo_core.sources import Frame


class FrameRange(msgspec.Struct, frozen=True):
    """The frames of a chunk: a part of a film that is tracked by itself."""

    first: int
    """Number of the first frame."""
    end: int | None
    """Number of the frame after the last; None for the rest of the film."""
    shared: int
    """Number of frames that each of the chunks before and after it tracks too."""
    is_coarse: bool = False
    """Of the `Traits` that frames before it have shown, like the next."""
    is_noiseless: bool = False

    @property
    def name(self) -> str:
        """Name of the chunk, which it keeps when it goes on after its end."""
        return f"chunk-{self.first}" + "-coarse" * self.is_coarse + "-noiseless" * self.is_noiseless

    def holds(self, frame: Frame) -> bool:
        """Whether a frame of the film comes before the end of the chunk."""
        return self.end is None or frame.index < self.end


class Untracked(msgspec.Struct, frozen=True):
    """The frames that no tracker can measure."""

    first: int
    last: dict[str, Any] | None
    """The `Estimate` of the frame before; None if no frame was tracked."""


class TrackRequest(msgspec.Struct, frozen=True):
    """Track a film; batches and checkpoints come before the answer, a `Problem`."""

    video: str
    rig: dict[str, Any]
    limits: Limits
    pace: float | None = None
    """Most seconds of video tracked per second."""
    checkpoint: str | None = None
    """File of the `KeptCheckpoint` to resume from; None to begin with the first frame."""
    journal: str | None = None
    """File of the journal that belongs to the checkpoint."""
    marks: list[Mark] = []
    """Marks of a camera's film."""
    frames: FrameRange | None = None
    """Frames to track, for a chunk; None for the whole film. Its results are for `chunks.join`."""
    untracked: Untracked | None = None
    """The rest of a film that cannot be tracked: its frames get rows without a pose."""


class Checkpoint(msgspec.Struct, frozen=True, tag="checkpoint"):
    """The state from which another tracker can continue after these frames.

    All their results have been sent before.
    """

    frames: int
    """Number of the next frame; the frames of a chunk count from the beginning of the film."""
    cpu_s: float
    """Processor time used so far."""
    state: bytes
    """State of the `Follower`, pickled. Only a tracker may decode it: unpickling runs any code that
    the bytes name, and they come from a process that has decoded hostile media. In another tracker,
    under the same limits, such code gains nothing; in the server it would gain everything."""


class KeptCheckpoint(msgspec.Struct, frozen=True):
    """A checkpoint on the disk."""

    stamp: str
    """Identifies program, video and rig; the checkpoint fits no others."""
    journal_bytes: int
    """Length of the journal covered by the checkpoint."""
    checkpoint: Checkpoint


class Passing(msgspec.Struct, frozen=True, tag="passing"):
    """Sent once a second while the tracker looks for the first frame of its chunk, or decodes the
    frames before its checkpoint again.
    """

    frames: int


class Placed(msgspec.Struct, frozen=True):
    """Where the results of a chunk lie in those of the film."""

    first: int
    """First frame whose results come from the chunk."""
    x_mm: float
    """Added to its distances."""
    sigma_mm: float
    """Standard deviation of `x_mm`, as the shared frames show it."""
    columns: int
    """Pixels by which its wall is moved along the pipe."""
    rows: int
    """Pixels by which its wall is moved around the pipe."""


class JoinWallsRequest(msgspec.Struct, frozen=True):
    """Join the walls of chunks; the tiles come before the answer, which is None."""

    folders: list[str]
    """Of each chunk, the folder of its layers, `<index>.png`."""
    placed: list[Placed]
    rig: dict[str, Any]
    limits: Limits
