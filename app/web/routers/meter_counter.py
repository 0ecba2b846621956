"""The connection to the software that uses Chainage as its meter counter."""

from fastapi import APIRouter

from app.web.deps import ServicesDep, viewer
from app.web.schemas.server import MeterCounterOut

router = APIRouter(prefix="/api/meter-counter", tags=["sources"])


@router.get("")
@viewer
def connection(services: ServicesDep) -> MeterCounterOut:
    """Return the state of the connection."""
    return MeterCounterOut.model_validate(services.meter_counter.connection())
