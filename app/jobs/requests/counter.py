"""The process that finds or reads the burnt-in counter of one film, then ends."""

from __future__ import annotations

import os
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from app.jobs import one_request
from app.jobs.messages import (
    CounterAt,
    CounterFound,
    CounterProgress,
    CounterRead,
    CounterRequest,
    encode,
)

if TYPE_CHECKING:  # loaded under the limits
    from app.burnt_in.box import Box
    from app.burnt_in.finder import CounterPlace

_REPORT_EVERY_S = 0.5
_NICENESS = 5
"""Tracking has three quarters of a core that both want; with 10 it took more than a minute on a
busy machine to read 16 frames.
"""


def _handle(request: CounterRequest, connection: Connection) -> None:
    if request.is_search:
        answer: CounterFound | CounterRead = _found(request)
    else:  # nobody waits for it, and tracking must not be slowed down
        os.nice(_NICENESS)
        answer = _read(request, connection)
    connection.send_bytes(encode(answer))


def _found(request: CounterRequest) -> CounterFound:
    from app.burnt_in.counter import burnt_in
    from vo_core import VideoFile

    video = Path(request.video)
    with VideoFile(video) as film:
        width, height = film.info.width, film.info.height
    found = burnt_in(video)
    return CounterFound(_at(found.place), found.film_date, width, height)


def _read(request: CounterRequest, connection: Connection) -> CounterRead:
    from app.burnt_in.counter import HEADER, burnt_in, read_counter

    reported_s = 0.0

    def report(done: int, total: int | None) -> None:
        nonlocal reported_s
        if time.monotonic() >= reported_s + _REPORT_EVERY_S:
            reported_s = time.monotonic()
            connection.send_bytes(encode(CounterProgress(done, total)))

    report(0, None)
    video = Path(request.video)
    found = burnt_in(video, _box(request))
    if found.place is None:  # most films; none of their frames is decoded for nothing
        return CounterRead(None, found.film_date, f"{HEADER}\n", None)
    readings = read_counter(video, found.place, report)
    return CounterRead(_at(found.place), found.film_date, readings.to_csv(), readings.problem)


def _box(request: CounterRequest) -> Box | None:
    from app.burnt_in.box import Box

    return None if request.within is None else Box(*request.within)


def _at(place: CounterPlace | None) -> CounterAt | None:
    if place is None:
        return None
    box = place.box
    corners_px = (box.left, box.top, box.right, box.bottom)
    return CounterAt(corners_px, place.decimals, place.unit, place.has_fields)


def main() -> None:
    """Handle the one request on the pipe, then end."""
    one_request.serve(
        CounterRequest,
        _handle,
        named="Reading the counter",
        reads=lambda request: [request.video],
    )


if __name__ == "__main__":
    main()
