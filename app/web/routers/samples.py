"""The sample inspection: a rendered culvert to try the program with."""

from __future__ import annotations

from fastapi import APIRouter

from app import errors
from app.inspections.samples import Samples
from app.web.deps import Service, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.sources import SampleOut

router = APIRouter(prefix="/api/samples", tags=["inspections"])


@router.get("")
@viewer
def state(samples: Service[Samples]) -> SampleOut:
    """Return the progress."""
    return SampleOut.of(samples.state())


@router.post("", status_code=202, responses=failures(errors.SampleBeingMade))
@operator
def start(samples: Service[Samples]) -> SampleOut:
    """Start rendering in the background; an existing sample is `ready` at once."""
    return SampleOut.of(samples.start())
