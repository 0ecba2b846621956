"""The day's work."""

from __future__ import annotations

from pydantic import BaseModel

from app.storage.index.work_list import Briefs, Section
from app.survey.assets.search_terms import WorkState


class WorkOut(BaseModel):
    """The sections to inspect, a page of them, and the inspections around them."""

    total: int
    pending: int
    """Inspections that are not indexed in their present state, so that the answer may lack them."""
    sections: list[Section]
    states: dict[WorkState, int]
    """Number of sections in each state, whatever state was asked for."""
    live: Briefs
    review: Briefs
    """Those that were submitted, or are in review."""
    past: Briefs
    """Those that have ended and are not in review."""
