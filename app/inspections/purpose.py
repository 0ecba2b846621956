"""The use that distances are meant for, one for the whole server."""

from __future__ import annotations

from dataclasses import asdict

import msgspec

from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.survey.distances.intended_use import IntendedUse


class Purpose:
    """Keeps the intended use as a blob; only the active server changes it."""

    def __init__(self, blobs: Blobs) -> None:
        self._blobs = blobs
        self._use: IntendedUse | None = None
        """None until it is first asked for."""

    def get(self) -> IntendedUse:
        """Return the stated use, or the usual one.

        Raises:
            StoreUnavailable: The object store is away.
        """
        if self._use is None:
            try:
                content = self._blobs.get(keys.INTENDED_USE)
            except FileNotFoundError:
                self._use = IntendedUse()
            else:
                self._use = msgspec.json.decode(content, type=IntendedUse)
        return self._use

    def put(self, use: IntendedUse) -> None:
        """State another use.

        Raises:
            StoreUnavailable: The object store is away; nothing is changed.
        """
        self._blobs.put(keys.INTENDED_USE, msgspec.json.encode(asdict(use)))
        self._use = use
