"""The burnt-in counter of a film: its readings, their comparison with the track, its place."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Response

from app import errors
from app.inspections.counters import Counters
from app.tracking.pictures.counter_queue import CounterQueue
from app.web import columns
from app.web.deps import InspectionId, Service, operator, viewer
from app.web.schemas.failures import content, failures
from app.web.schemas.inspection.counter import CounterIn, CounterOut
from app.web.slow import slow

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["counter"])


@router.get("/counter")
@viewer
@slow
def get(
    inspection_id: InspectionId, counter_queue: Service[CounterQueue], counters: Service[Counters]
) -> CounterOut:
    """Return what is known of the counter, and what it and the raw track say about each other."""
    return _shown(inspection_id, counter_queue, counters)


@router.put(
    "/counter",
    responses=failures(errors.InspectionLocked, errors.NothingRecorded, errors.PixelOutsidePicture),
)
@operator
@slow
def put(
    inspection_id: InspectionId,
    body: CounterIn,
    counter_queue: Service[CounterQueue],
    counters: Service[Counters],
) -> CounterOut:
    """State where the counter is, its unit, or that there is none; it is read once the film is
    tracked.
    """
    counter_queue.state(inspection_id, body.to_kept())
    return _shown(inspection_id, counter_queue, counters)


@router.post("/counter/cancel", responses=failures(errors.InspectionLocked, errors.NotRunning))
@operator
@slow
def cancel(
    inspection_id: InspectionId, counter_queue: Service[CounterQueue], counters: Service[Counters]
) -> CounterOut:
    """Stop reading the counter; it is not read unless somebody asks for it again."""
    counter_queue.cancel(inspection_id)
    return _shown(inspection_id, counter_queue, counters)


@router.get(
    "/counter/readings",
    response_class=Response,
    responses=content("text/csv", columns.MEDIA_TYPE),
)
@viewer
@slow
def readings(
    inspection_id: InspectionId,
    counters: Service[Counters],
    format: Literal["csv", "columns"] = "csv",  # noqa: A002  (as that of the track)
) -> Response:
    """Return the reading of each frame: in its own unit as csv; in m, NaN where it is not legible,
    as `columns`, see `app.web.columns`. Without a reading there are no rows.
    """
    view = counters.get(inspection_id)
    if format == "csv":
        return Response(view.csv, media_type="text/csv; charset=utf-8")
    metres = view.reading_m
    packed = columns.packed({"counter_m": metres}, run=view.version, total=len(metres))
    return Response(packed, media_type=columns.MEDIA_TYPE)


def _shown(inspection_id: str, counter_queue: CounterQueue, counters: Counters) -> CounterOut:
    # Before the rest: if reading ends in between, the answer is of the state after it.
    progress = counter_queue.progress(inspection_id)
    return CounterOut.of(counters.get(inspection_id), progress)
