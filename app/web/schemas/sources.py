"""Sources of films: live sources, and the sample."""

from __future__ import annotations

from typing import Literal

from app.inspections.samples import SampleState
from app.web.schemas.failures import ErrorOut
from app.web.schemas.out import Out, Thousandths


class ListedSourceOut(Out):
    """A live source found by the server."""

    url: str
    kind: Literal["usb", "folder", "pipe"]
    name: str


class SourcesOut(Out):
    """Live sources found by the server."""

    sources: list[ListedSourceOut]


class SampleOut(Out):
    """Progress of the sample inspection, which is rendered once and kept in the data folder."""

    state: Literal["none", "rendering", "ready", "failed"]
    progress: Thousandths
    """From 0 to 1."""
    inspection_id: str | None
    """Set when the sample is ready."""
    error: ErrorOut | None

    @classmethod
    def of(cls, state: SampleState) -> SampleOut:
        """Convert the service's state."""
        fault = state.fault
        error = None if fault is None else ErrorOut(code="sample_failed", detail=fault)
        return cls.read_from(state, error=error)
