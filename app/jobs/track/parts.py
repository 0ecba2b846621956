"""Marks of a camera's film: frames that were not recorded, and where parts begin.

They are stored beside the film as parts.csv, with the columns `frame,time_s,kind`, so that a frame
keeps its number when the film is tracked again. `left_out`: there was no room to record this
tracked frame. `stood_still` and `moved`: a new part of the recording begins with this frame, and
the operator stated that movement of the robot since the previous frame.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec

if TYPE_CHECKING:
    from vo_core.sources import Frame

Between = Literal["stood_still", "moved"]
"""Movement of the robot between two parts."""


class Mark(msgspec.Struct, frozen=True, order=True, array_like=True):
    """One line of the file."""

    frame: int
    time_s: float
    kind: Literal["left_out", "stood_still", "moved"]


NOT_RECORDED = (
    "The disk was full, so this frame was tracked but not recorded; there is no picture of it."
)


def read(path: Path) -> list[Mark]:
    """Return all marks, none without a file."""
    return parsed(path.read_text("ascii")) if path.exists() else []


def parsed(text: str) -> list[Mark]:
    """Return the marks of such a file; skip a line that a crash has cut off."""
    marks = []
    for line in text.splitlines(keepends=True):
        if line.endswith("\n"):
            frame, time_s, kind = line.strip().split(",")
            marks.append(msgspec.convert([int(frame), float(time_s), kind], Mark))
    return marks


def text_of(marks: Iterable[Mark]) -> str:
    """Format these marks as lines."""
    return "".join(f"{mark.frame},{mark.time_s:.6f},{mark.kind}\n" for mark in marks)


def append(path: Path, marks: Iterable[Mark]) -> None:
    """Append marks durably.

    Raises:
        OSError: There is no room; the file is unchanged.
    """
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        size = os.fstat(file).st_size
        view = memoryview(text_of(marks).encode())
        try:
            while view:
                view = view[os.write(file, view) :]
            os.fsync(file)
        except OSError:
            os.ftruncate(file, size)
            raise
    finally:
        os.close(file)


@dataclass(frozen=True)
class Numbered:
    """A frame of the film with its number in the run."""

    frame: Frame
    left_out: list[tuple[int, float]] = field(default_factory=list)
    """Number and time of the frames just before it that are missing from the film."""
    between: Between | None = None
    """The robot's movement, if the frame begins a new part."""


def numbered(frames: Iterable[Frame], marks: Iterable[Mark], first: int = 0) -> Iterator[Numbered]:
    """Give each frame of a film the number that it had when it was captured.

    Args:
        frames: Frames of a film, in order.
        marks: Marks of that film.
        first: Number of the first frame, or of the first frame left out before it.
    """
    left_out = {mark.frame: mark.time_s for mark in marks if mark.kind == "left_out"}
    parts: dict[int, Between] = {mark.frame: mark.kind for mark in marks if mark.kind != "left_out"}
    index = first
    for frame in frames:
        skipped = []
        while index in left_out:
            skipped.append((index, left_out[index]))
            index += 1
        begins = [parts[each] for each in (*(n for n, _ in skipped), index) if each in parts]
        yield Numbered(replace(frame, index=index), skipped, begins[-1] if begins else None)
        index += 1


def left_out_after(marks: Iterable[Mark], end: int) -> list[tuple[int, float]]:
    """Return number and time of the frames from `end` on, which the film lacks."""
    return [
        (mark.frame, mark.time_s) for mark in marks if mark.kind == "left_out" and mark.frame >= end
    ]
