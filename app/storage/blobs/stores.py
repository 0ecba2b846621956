"""Opens the store of blobs that a server or a worker was set to."""

from __future__ import annotations

from pathlib import Path

from app.settings import SCRATCH_BYTES
from app.storage.blobs.blobs import Blobs
from app.storage.blobs.folder import FolderBlobs
from app.storage.blobs.objects import ObjectBlobs


def blobs_at(url: str | None, folder: Path, *, scratch_bytes: int = SCRATCH_BYTES) -> Blobs:
    """Return the store of a server or of a worker; nothing is requested.

    Args:
        url: `s3://bucket/prefix?endpoint=https://host:port&region=name`, all but the bucket
            optional; credentials come from the variables AWS_*. None stands for `folder`.
        folder: The data folder: it contains the blobs, or else the scratch copies.
        scratch_bytes: Most bytes of scratch copies.
    Raises:
        InvalidSettings: The URL is not understood, or obstore is not installed.
    """
    if url is None:
        return FolderBlobs(folder)
    return ObjectBlobs(url, folder / "scratch", scratch_bytes)
