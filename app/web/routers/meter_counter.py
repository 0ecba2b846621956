"""How it is with the software that takes Chainage for its meter counter."""

from fastapi import APIRouter

from app.web.deps import ServicesDep, viewer
from app.web.schemas.server import MeterCounterOut

router = APIRouter(prefix="/api/meter-counter", tags=["sources"])


@router.get("")
@viewer
def connection(services: ServicesDep) -> MeterCounterOut:
    """Whether it is connected."""
    return MeterCounterOut.of(services.meter_counter.connection())
