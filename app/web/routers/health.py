"""Alive and ready, for whoever watches the server; no log-in."""

from dataclasses import asdict

from fastapi import APIRouter

from app.web.deps import ServicesDep
from app.web.schemas.server import AliveOut, CheckOut, ReadyOut

router = APIRouter(tags=["health"])


@router.get("/healthz")
def alive() -> AliveOut:
    """The server runs."""
    return AliveOut(status="alive")


@router.get("/readyz")
def ready(services: ServicesDep) -> ReadyOut:
    """The database takes writes, the disk has room, the workers run; 503 says what is not."""
    checks = [CheckOut(**asdict(check)) for check in services.health.ready()]
    return ReadyOut(status="ready", checks=checks)
