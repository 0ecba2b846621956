"""Liveness and readiness for monitoring, without log-in."""

from dataclasses import asdict

from fastapi import APIRouter

from app.ops.health import Health
from app.web.deps import Service
from app.web.schemas.server import AliveOut, CheckOut, ReadyOut

router = APIRouter(tags=["health"])


@router.get("/healthz")
def alive() -> AliveOut:
    """Answer while the server runs."""
    return AliveOut(status="alive")


@router.get("/readyz")
def ready(health: Service[Health]) -> ReadyOut:
    """Check that the database accepts writes, the disk has room and the workers run; else 503."""
    checks = [CheckOut(**asdict(check)) for check in health.ready()]
    return ReadyOut(status="ready", checks=checks)
