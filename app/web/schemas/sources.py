"""Sources of films: live sources, and the sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pydantic import BaseModel

from app.inspections.samples import SampleState
from app.tracking.cameras import ListedSource
from app.web.schemas.failures import ErrorOut


class ListedSourceOut(BaseModel):
    """A live source found by the server."""

    url: str
    kind: Literal["usb", "folder", "pipe"]
    name: str


class SourcesOut(BaseModel):
    """Live sources found by the server."""

    sources: list[ListedSourceOut]

    @classmethod
    def of(cls, listed: Sequence[ListedSource]) -> SourcesOut:
        """Convert the service's list."""
        return cls(
            sources=[ListedSourceOut(url=it.url, kind=it.kind, name=it.name) for it in listed]
        )


class SampleOut(BaseModel):
    """Progress of the sample inspection, which is rendered once and kept in the data folder."""

    state: Literal["none", "rendering", "ready", "failed"]
    progress: float
    """From 0 to 1."""
    inspection_id: str | None
    """Set when the sample is ready."""
    error: ErrorOut | None

    @classmethod
    def of(cls, state: SampleState) -> SampleOut:
        """Convert the service's state."""
        fault = state.fault
        return cls(
            state=state.state,
            progress=round(state.progress, 3),
            inspection_id=state.inspection_id,
            error=None if fault is None else ErrorOut(code="sample_failed", detail=fault),
        )
