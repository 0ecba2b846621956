"""Failures grouped by their reason, and how each kind of reason is repaired."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Literal

from app.archive.paths import line_of
from app.storage.archive.films import Failure

Repair = Literal["rig", "retry", "film"]

_NUMBER = re.compile(r"(?<!\w)\d+(?:[.,:]\d+)*")
_REPAIRS: dict[str, Repair] = {
    "invalid_rig": "rig",
    "no_wall_in_view": "rig",
    "rig_video_mismatch": "rig",
    "unreadable_video": "film",
    "film_missing": "film",
    "nothing_recorded": "film",
    "media_failed": "film",
    "film_changed": "retry",
    "inspection_locked": "retry",
    "internal_error": "retry",
    "media_timeout": "retry",
    "out_of_memory": "retry",
    "tracking_failed": "retry",
    "tracking_process_died": "retry",
    "tracking_stalled": "retry",
}


@dataclass(frozen=True)
class Group:
    """Films that failed for the same reason."""

    code: str
    reason: str
    """The sentence without its numbers and the name of the film."""
    count: int
    example: Failure
    repair: Repair | None
    """Another rig, only another try, or another film in its place."""


def grouped(failures: Iterable[Failure]) -> list[Group]:
    """Group failures by code and reason, the largest group first."""
    groups: dict[tuple[str, str], list[Failure]] = {}
    for failure in failures:
        groups.setdefault((failure.code, reason_of(failure)), []).append(failure)
    found = [
        Group(code, reason, len(films), films[0], _REPAIRS.get(code))
        for (code, reason), films in groups.items()
    ]
    return sorted(found, key=lambda group: (-group.count, group.code, group.reason))


def reason_of(failure: Failure) -> str:
    """Return the sentence of a failure without what differs from film to film."""
    sentence = failure.detail.replace(line_of(PurePosixPath(failure.path).name), "The film")
    return _NUMBER.sub("…", sentence)
