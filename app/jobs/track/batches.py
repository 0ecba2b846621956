"""The results of tracking, as they go from the tracker to the server and into the journal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

import msgspec

from app.jobs.messages import encode
from vo_core.geometry.initial_pose import InitialPose
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.sightings import Sighting
from vo_core.track import Estimate


class WallPicture(msgspec.Struct, frozen=True, array_like=True):
    """One tile of the unrolled wall."""

    index: int
    content: bytes
    """JPEG; a chunk's own wall is a PNG of four channels: the picture, and how well each place was
    seen."""


class Tie(msgspec.Struct, frozen=True, array_like=True):
    """What the join of chunks needs of a frame beside its estimate."""

    frame: int
    systematic_mm: float
    """`Odometry.systematic_mm`."""
    bed_mm: float
    """`Odometry.bed_mm`."""
    picture: int
    """Checksum of the picture if two chunks track it, never 0; else 0."""
    is_coarse: bool
    """Of `Odometry.traits`, like the next."""
    is_noiseless: bool


class Evidence(msgspec.Struct, frozen=True, array_like=True):
    """What smoothing needs of the frames since the last batch; see `vo_core.records.Records`."""

    begin: int
    """Where it stands in that of all frames: what a later batch replaces counts no more."""
    content: bytes


class Batch(msgspec.Struct, frozen=True, tag="batch"):
    """The frames since the last batch, and the picture of the last of them."""

    estimates: list[Estimate]
    jpeg: bytes = b""
    captured_s: float | None = None
    """Time when the picture's frame came from its camera, by `time.monotonic`; None for files."""
    health: list[tuple[int, Health]] = []
    """Number and health of the tracked frames; frames in between were left out."""
    tiles: list[WallPicture] = []
    """Changed tiles of the unrolled wall."""
    sightings: list[Sighting] = []
    """Joints that were detected."""
    tilt: MountTilt | None = None
    """Tilt of the mount against the rig, from all frames so far."""
    initial_pose: InitialPose | None = None
    """Where the camera stood at the first frame of the run; None while the newest part shows it
    worse than those before."""
    ties: list[Tie] = []
    """Of a chunk: one for each frame."""
    start: InitialPose | None = None
    """Of a chunk: `Odometry.start`."""
    smoothed: list[Estimate] = []
    """At the end of a run: its next rows anew, each by what all frames show."""
    layers: list[WallPicture] = []
    """Of a chunk, in place of `tiles`: the tiles that it has left."""
    evidence: Evidence | None = None
    """Only for the journal, from which another tracker takes it."""


_LENGTH_BYTES = 8
"""Length of the size in front of each entry of a journal."""


def entry_of(batch: Batch) -> bytes:
    """Encode a batch as an entry of a journal, without pictures."""
    entry = encode(msgspec.structs.replace(batch, jpeg=b"", tiles=[], layers=[]))
    return len(entry).to_bytes(_LENGTH_BYTES, "big") + entry


def batches_of(journal: BinaryIO, end: int) -> list[Batch]:
    """Read the entries of a journal up to a place; what is only for a tracker is left out.

    Raises:
        msgspec.MsgspecError: It is no journal.
    """
    return [msgspec.structs.replace(each, evidence=None) for each in _entries(journal, end)]


def evidence_of(journal: BinaryIO, end: int) -> bytearray:
    """Join the evidence in a journal up to a place."""
    found = bytearray()
    for batch in _entries(journal, end):
        if batch.evidence is not None:
            del found[batch.evidence.begin :]
            found += batch.evidence.content
    return found


def _entries(journal: BinaryIO, end: int) -> Iterator[Batch]:
    """Read one after the other, as all of them need more memory than a server has for it."""
    decoder = msgspec.msgpack.Decoder(Batch)
    while (at := journal.tell()) < end:
        size = int.from_bytes(journal.read(_LENGTH_BYTES), "big")
        yield decoder.decode(journal.read(min(size, end - at)))
