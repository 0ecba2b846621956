"""The connection to the software that uses Chainage as its meter counter."""

from fastapi import APIRouter

from app.meter_counter.line import MeterCounter
from app.web.deps import Service, viewer
from app.web.schemas.server import MeterCounterOut

router = APIRouter(prefix="/api/meter-counter", tags=["sources"])


@router.get("")
@viewer
def connection(meter_counter: Service[MeterCounter]) -> MeterCounterOut:
    """Return the state of the connection."""
    return MeterCounterOut.model_validate(meter_counter.connection())
