"""An archive of ten thousand films, written into the database before the server starts."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from builders import clip_rig
from sqlalchemy import insert

from app.storage.database.database import Database
from app.storage.database.tables import ArchiveFilm, Inspection

FILMS = 10_000
TRACKED = 120
"""Films that are inspections; the rest wait for a rig."""
NOW = datetime(2026, 1, 1, tzinfo=UTC)
LONG_NAME = "a name that somebody wrote in full because the contract asked for it"


def fill(data: Path) -> None:
    """Make the database of a data folder."""
    data.mkdir(parents=True, exist_ok=True)
    database = Database(data / "chainage.db")
    try:
        database.write(lambda session: session.execute(insert(ArchiveFilm), list(_films())))
        database.write(lambda session: session.execute(insert(Inspection), list(_inspections())))
    finally:
        database.close()


def name_of(number: int) -> str:
    """Each hundredth is long."""
    return f"CUL-{number:05d}" + (f" {LONG_NAME}" if number % 100 == 7 else "")


def _id_of(number: int) -> str:
    return f"{number:032x}"


def _films() -> Iterator[dict[str, Any]]:
    for number in range(FILMS):
        project = f"Project {number % 10}"
        relative = f"{project}/{name_of(number)}.mp4"
        path = f"/films/{relative}"
        yield {
            "id": _id_of(number), "path": path, "relative": relative, "size": 10**9,
            "path_sha256": hashlib.sha256(path.encode()).hexdigest(), "modified_at": NOW,
            "name": name_of(number), "project": project, "asset": f"A-{number // 4}",
            "rig": None, "header": {}, "priority": 0, "state": "idle",
            "added_at": NOW, "added_by": "test",
        }  # fmt: skip


def _inspections() -> Iterator[dict[str, Any]]:
    video = {
        "width": 256, "height": 160, "duration_s": 1.0, "frames": 25, "codec": "h264",
        "playable": True, "media_type": "video/mp4",
    }  # fmt: skip
    for number in range(TRACKED):
        at = NOW - timedelta(minutes=number)
        yield {
            "id": _id_of(number), "name": name_of(number), "status": "done", "rig": clip_rig(),
            "header": {}, "source_kind": "upload", "source_filename": f"{number}.mp4",
            "source_size": 1000, "source_sha256": "0" * 64, "video_file": "video.mp4",
            "video": video, "frames_done": 25, "distance_mm": 1000.0 + number,
            "corrections": {}, "revision": 0, "created_at": at, "queued_at": at, "finished_at": at,
            "priority": 0, "attempt": 0,
        }  # fmt: skip
