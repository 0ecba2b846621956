"""Metrics for monitoring systems that hold a token."""

from fastapi import APIRouter
from fastapi.responses import PlainTextResponse
from prometheus_client import CONTENT_TYPE_PLAIN_0_0_4

from app.ops.metrics import Metrics
from app.web.deps import Service, viewer

router = APIRouter(tags=["health"])


@router.get("/metrics", response_class=PlainTextResponse)
@viewer
def metrics(metrics: Service[Metrics]) -> PlainTextResponse:
    """Return counters and gauges in the text format of Prometheus."""
    return PlainTextResponse(metrics.text(), media_type=CONTENT_TYPE_PLAIN_0_0_4)
