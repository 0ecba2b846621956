"""The server itself: its health, what it counts, the cameras and the software that it sees."""

from __future__ import annotations

from dataclasses import asdict

from fastapi import APIRouter
from fastapi.responses import PlainTextResponse
from prometheus_client import CONTENT_TYPE_PLAIN_0_0_4

from app.inspections.purpose import Purpose
from app.meter_counter.line import MeterCounter
from app.ops.health import Health
from app.ops.metrics import Metrics
from app.survey.distances.intended_use import IntendedUse
from app.tracking.cameras import Sources
from app.web.deps import Service, of_projects, viewer
from app.web.schemas.server import (
    AliveOut,
    CheckOut,
    IntendedUseIn,
    MeterCounterOut,
    ReadyOut,
    SourcesOut,
)

router = APIRouter()


@router.get("/api/sources", tags=["sources"])
@viewer
@of_projects
def sources(sources: Service[Sources]) -> SourcesOut:
    """Return the sources that can be opened besides network cameras."""
    return SourcesOut.model_validate({"sources": sources.listed()})


@router.get("/api/meter-counter", tags=["sources"])
@viewer
@of_projects
def connection(meter_counter: Service[MeterCounter]) -> MeterCounterOut:
    """Return the state of the connection."""
    return MeterCounterOut.model_validate(meter_counter.connection())


@router.get("/api/intended-use", tags=["inspections"])
@viewer
@of_projects
def intended_use(purpose: Service[Purpose]) -> IntendedUseIn:
    """Return how wide the interval of a distance may be before it is of no use."""
    return IntendedUseIn.model_validate(asdict(purpose.get()))


@router.put("/api/intended-use", tags=["inspections"])
def intend(body: IntendedUseIn, purpose: Service[Purpose]) -> IntendedUseIn:
    """State how wide it may be; every inspection is judged by that from now on."""
    purpose.put(IntendedUse(body.within_m, body.percent))
    return body


@router.get("/healthz", tags=["health"])
def alive() -> AliveOut:
    """Answer while the server runs."""
    return AliveOut(status="alive")


@router.get("/readyz", tags=["health"])
def ready(health: Service[Health]) -> ReadyOut:
    """Check that the database accepts writes, the disk has room and the workers run; else 503."""
    checks = [CheckOut(**asdict(check)) for check in health.ready()]
    return ReadyOut(status="ready", checks=checks)


@router.get("/metrics", tags=["health"], response_class=PlainTextResponse)
@viewer
def metrics(metrics: Service[Metrics]) -> PlainTextResponse:
    """Return counters and gauges in the text format of Prometheus."""
    return PlainTextResponse(metrics.text(), media_type=CONTENT_TYPE_PLAIN_0_0_4)
