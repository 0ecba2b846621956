"""Reads the burnt-in counter of one film in a child process: of the server, or of a worker."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from app.burnt_in.box import Box
from app.burnt_in.readings import ReadFilm
from app.jobs.messages import Limits, Progress
from app.jobs.process import Child, ask_about_media
from app.jobs.requests.counter import CounterRequest
from app.storage.blobs.blobs import Blobs
from app.tracking.films.work import IsStopped, polling

CHILD = "app.jobs.requests.counter"
"""Module of the process that finds and reads counters."""
_STALL_S = 600.0
"""Time without progress that counts as a stall. Of low priority, a child may get no processor for
minutes."""

OnProgress = Callable[[Progress], None]


class CounterOrder(msgspec.Struct, frozen=True):
    """A film whose counter is to be read."""

    film: str
    """Key of the film in the blob store."""
    within: Box | None
    """A part of the picture that holds the counter; without it, it is searched."""
    limits: Limits


def read_counter(
    order: CounterOrder, blobs: Blobs, *, is_stopped: IsStopped, report: OnProgress
) -> ReadFilm:
    """Read the counter in every frame of a film.

    Args:
        order: What is to be read.
        blobs: The store with the film.
        is_stopped: Asked about twice a second; once it is true, the reading fails.
        report: Called with the progress.
    Raises:
        UnreadableVideo, MediaTimeout, MediaFailed: It cannot be read, or was stopped.
    """
    with (
        blobs.local(order.film) as path,
        Child(CHILD) as child,
        polling(lambda: is_stopped() or not path.exists(), child.terminate),
    ):
        return ask_about_media(
            child,
            CounterRequest(str(path), order.limits, order.within),
            ReadFilm,
            work="Reading the counter",
            stall_s=_STALL_S,
            part=Progress,
            on_part=report,
        )
