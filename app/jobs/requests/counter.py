"""The process that finds or reads the burnt-in counter of one film, then ends."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from app.burnt_in.box import Box
from app.jobs.child import Parent, serve
from app.jobs.messages import Limits, Progress

if TYPE_CHECKING:  # loaded under the limits
    from app.burnt_in.readings import BurntIn, ReadFilm

_REPORT_EVERY_S = 0.5
_NICENESS = 5
"""Tracking has three quarters of a core that both want; with 10 it took more than a minute on a
busy machine to read 16 frames.
"""


class CounterRequest(msgspec.Struct, frozen=True):
    """Find the counter, which is answered by `BurntIn`, or read it, which is by `ReadFilm`."""

    video: str
    limits: Limits
    within: Box | None = None
    """A part of the picture that holds the counter; without it, it is searched."""
    is_search: bool = False
    """Whether to find the counter only, and not to read it in every frame."""


def _handle(request: CounterRequest, parent: Parent) -> BurntIn | ReadFilm:
    from app.burnt_in.counter import burnt_in

    if request.is_search:
        return burnt_in(Path(request.video))
    os.nice(_NICENESS)  # nobody waits for it, and tracking must not be slowed down
    return _read(request, parent)


def _read(request: CounterRequest, parent: Parent) -> ReadFilm:
    from app.burnt_in.counter import burnt_in, read_counter
    from app.burnt_in.readings import HEADER, ReadFilm

    reported_s = 0.0

    def report(done: int, total: int | None) -> None:
        nonlocal reported_s
        if time.monotonic() >= reported_s + _REPORT_EVERY_S:
            reported_s = time.monotonic()
            parent.send(Progress(done, total))

    report(0, None)
    video = Path(request.video)
    found = burnt_in(video, request.within)
    if found.place is None:  # most films; none of their frames is decoded for nothing
        return ReadFilm(found, f"{HEADER}\n", None)
    readings = read_counter(video, found.place, report)
    return ReadFilm(found, readings.to_csv(), readings.problem)


if __name__ == "__main__":
    serve(
        CounterRequest,
        _handle,
        named="Reading the counter",
        reads=lambda request: [request.video],
    )
