"""Findings on the wall: proposals, their search, and decisions."""

from __future__ import annotations

import math
from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from pydantic import Field, StringConstraints, create_model

from app.inspections.findings.findings import Listed
from app.inspections.findings.sighting import Figure, FindingView
from app.survey.adjustment.adjusted_track import Source
from app.survey.findings.records import (
    CLASSICAL,
    Direction,
    FindingState,
    SearchState,
    SearchStatus,
)
from app.survey.given import Frame, Given, Pixel
from app.survey.observations.tag import Tag
from app.web.deps import OBSERVATION_ID
from app.web.schemas.out import Out, metres


class FindingSearchIn(Given):
    """What to search with."""

    detector: Annotated[str, StringConstraints(pattern=rf"^({CLASSICAL}|[0-9a-f]{{32}})$")] = Field(
        CLASSICAL, description=f"{CLASSICAL!r}, or the id of one of /api/detectors"
    )


class FindingSearchOut(Out):
    """How far the search of the wall is."""

    state: SearchState
    detail: str | None
    """A sentence that says why it failed, or who stopped it."""
    detector: str | None
    """`classical`, or the id of one of /api/detectors."""
    searched_to_m: float | None
    """Corrected distance."""

    @classmethod
    def of(cls, status: SearchStatus, searched_to_mm: float | None) -> FindingSearchOut:
        """Convert the state; the distance is corrected."""
        return cls.read_from(status, searched_to_m=metres(searched_to_mm))


class FindingCountsOut(Out):
    """How many findings are in each state."""

    offered: int
    accepted: int
    rejected: int


class FindingSizeOut(Out):
    """A size with its 95 % interval."""

    value: float
    low: float
    high: float


class SuggestedOut(Out):
    """Fields of a tag to start from, beside frame and pixel; null where a person must look."""

    code: str | None = None
    char1: str | None = None
    char2: str | None = None
    quant1: float | None = None
    quant2: float | None = None
    clock_from: int | None = None
    clock_to: int | None = None


class FindingOut(Out):
    """A finding, with what derives from the present track and corrections."""

    id: str
    kind: str
    """crack, joint_open, joint_displaced, hole, spall, deposit, roots, water, stain; or a kind of a
    user's model."""
    detector: str
    """Its name and version."""
    score: float
    """In [0, 1]; a larger one is surer."""
    state: FindingState
    distance_m: float
    """Corrected distance of its middle; the next two are those of its ends."""
    from_m: float
    to_m: float
    distance_u95_m: float | None
    """Half of the 95 % interval; null where no frame shows it, or nothing is known."""
    distance_source: Source | None
    clock: int | None
    """Hour, or where its sector begins; null on a floor."""
    clock_to: int | None
    y_mm: float
    """To the right of the axis."""
    length_mm: FindingSizeOut | None
    width_mm: FindingSizeOut | None
    direction: Direction | None
    suggested: SuggestedOut
    frame: int | None
    """The frame that shows it best, and the pixel; null if none does."""
    pixel: Pixel | None
    outline: list[Annotated[list[float], Field(min_length=2, max_length=2)]]
    """[distance in mm, arc in mm] on the raw wall, as the rows and columns of /unrolled: the centre
    line of a crack, otherwise a closed polygon."""
    decided_by: str | None
    decided_at: datetime | None
    observation_id: str | None

    @classmethod
    def of(cls, view: FindingView) -> FindingOut:
        """Convert the service's view."""
        return cls.model_validate(_values_of(view))


class FindingsOut(Out):
    """The findings of an inspection, along the pipe."""

    search: FindingSearchOut
    counts: FindingCountsOut
    findings: list[FindingOut]


# Corrections compute in numpy scalars, which JSON does not know.
_encode = msgspec.json.Encoder(enc_hook=lambda scalar: scalar.item()).encode


def findings_json(listed: Listed, search: FindingSearchOut) -> bytes:
    """Return a `FindingsOut` as JSON; to make thousands of models took a second."""
    counts = {
        state: sum(getattr(count, state) for count in listed.counts)
        for state in FindingCountsOut.model_fields
    }
    found = [_values_of(view) for view in listed.views]
    return _encode({"search": search.model_dump(), "counts": counts, "findings": found})


def _values_of(view: FindingView) -> dict[str, Any]:
    """Return the fields of a `FindingOut`."""
    finding, where, place, seen = view.finding, view.where, view.place, view.seen
    sector = where.sector
    return {
        "id": finding.id,
        "kind": finding.kind,
        "detector": finding.found_by,
        "score": round(finding.score, 3),
        "state": finding.state,
        "distance_m": metres(view.distance_mm),
        "from_m": round(where.from_mm / 1000, 4),
        "to_m": round(where.to_mm / 1000, 4),
        "distance_u95_m": place.u95_m if place else None,
        "distance_source": place.source if place else None,
        "clock": sector.clock_from if sector else None,
        "clock_to": sector.clock_to if sector else None,
        "y_mm": round(where.lateral_mm, 1),
        "length_mm": _size_of(view.length),
        "width_mm": _size_of(view.width),
        "direction": finding.direction,
        "suggested": _NOTHING_SUGGESTED | view.suggested,
        "frame": seen.frame if seen else None,
        "pixel": list(seen.pixel) if seen else None,
        "outline": [list(point) for point in finding.outline_mm],
        "decided_by": finding.decided_by,
        "decided_at": finding.decided_at,
        "observation_id": finding.observation_id,
    }


_NOTHING_SUGGESTED = dict.fromkeys(SuggestedOut.model_fields)


def _size_of(figure: Figure | None) -> dict[str, float] | None:
    if figure is None:
        return None
    return {
        "value": round(figure.value, 1),
        "low": math.floor(10 * figure.low) / 10,
        "high": math.ceil(10 * figure.high) / 10,
    }


if TYPE_CHECKING:
    TagChanges = Tag
else:  # no field is required
    TagChanges = create_model("TagChanges", __base__=Tag, frame=(Frame | None, None))


class AcceptIn(Given):
    """Accept a finding."""

    observation_id: Annotated[str, StringConstraints(pattern=OBSERVATION_ID)] = Field(
        description="UUID of the new observation, made by the page: a repeated request names the "
        "same one"
    )
    changes: TagChanges | None = Field(
        None, description="Fields of the tag in place of the suggested ones; null for none"
    )

    def stated(self) -> dict[str, Any]:
        """Return the fields that are stated."""
        fields = self.changes.model_dump(exclude_unset=True) if self.changes else {}
        if fields.get("frame", 0) is None:
            del fields["frame"]
        return fields
