"""The recording of a camera; it pauses while the disk is full and resumes afterwards.

Tracking goes on meanwhile. Frames captured during the pause are noted in parts.csv before the next
packet is recorded, so that every frame keeps its number.
"""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Sequence
from pathlib import Path

from app.jobs.live.recording import Coding, Recording
from app.jobs.track import parts
from app.jobs.track.parts import Mark

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
ROOM_TO_GO_ON = 32 * 2**20
"""Bytes free beyond the reserve before recording resumes, so that it does not stop at once."""


class Film:
    """A recording and its marks, created with the first picture."""

    def __init__(
        self, path: Path, marks_path: Path, pending: Sequence[Mark], reserve_bytes: int
    ) -> None:
        """Continue a file that exists.

        Args:
            path: The recording.
            marks_path: Its parts.csv.
            pending: Marks that are not yet in that file.
            reserve_bytes: Disk space to leave free.
        Raises:
            UnreadableVideo: The existing file is no recording.
        """
        self._path, self._marks_path = path, marks_path
        self._reserve_bytes = reserve_bytes
        self._lock = threading.Lock()
        self._pending, self._news = list(pending), list[Mark]()
        self._left_out_ms: set[int] = set()
        self._latest_left_out_ms = max((round(1000 * m.time_s) for m in pending), default=None)
        self.is_full = False
        self.recording = Recording.reopen(path) if path.exists() else None

    def begin(self, coding: Coding) -> None:
        """Create the file.

        Raises:
            OSError: There is no room for the file.
        """
        self.recording = Recording(self._path, coding)

    @property
    def last_ms(self) -> int | None:
        """Latest time of a packet, recorded or left out; None before the first."""
        recorded_ms = self.recording.last_ms if self.recording else None
        return max(
            (ms for ms in (recorded_ms, self._latest_left_out_ms) if ms is not None), default=None
        )

    def append(self, time_ms: int, is_key: bool, packet: bytes) -> None:
        """Record a packet, or leave it out while there is no room."""
        assert self.recording is not None  # noqa: S101  (begun with the first picture)
        try:
            if self.is_full:
                if not (is_key and self._free_bytes() > ROOM_TO_GO_ON):
                    self._leave_out(time_ms)
                    return
                self._keep_marks()
                self.is_full = False
            self.recording.append(time_ms, is_key, packet)
        except OSError as error:
            self._stop_if_full(error)
            self._leave_out(time_ms)

    def note(self, frame: int, time_ms: int) -> None:
        """Assign a number to a picture, and mark it if its packet was left out."""
        if time_ms in self._left_out_ms:
            self._left_out_ms.remove(time_ms)
            mark = Mark(frame, time_ms / 1000, "left_out")
            with self._lock:
                self._pending.append(mark)
                self._news.append(mark)

    def news(self) -> list[Mark]:
        """Return the marks since the last call."""
        with self._lock:
            news, self._news = self._news, []
        return news

    def look_after_disk(self) -> None:
        """Sync the recording, and pause before the disk is full."""
        if self._free_bytes() < 0:
            self.is_full = True
        if self.recording is not None:
            try:
                self.recording.sync()
            except OSError as error:
                self._stop_if_full(error)

    def close(self) -> None:
        """Close the recording; the parent stores marks for which there was no room."""
        if self.recording is None:
            return
        with self.recording:
            try:
                self._keep_marks()
                self.recording.finish()
            except OSError as error:
                self._stop_if_full(error)

    def _leave_out(self, time_ms: int) -> None:
        self._left_out_ms.add(time_ms)
        self._latest_left_out_ms = max(time_ms, self._latest_left_out_ms or 0)

    def _keep_marks(self) -> None:
        with self._lock:
            pending = list(self._pending)
        if pending:
            parts.append(self._marks_path, pending)
            with self._lock:
                del self._pending[: len(pending)]

    def _free_bytes(self) -> int:
        disk = os.statvfs(self._path.parent)
        return disk.f_bavail * disk.f_frsize - self._reserve_bytes

    def _stop_if_full(self, error: OSError) -> None:
        if error.errno not in NO_ROOM:
            raise error
        self.is_full = True
