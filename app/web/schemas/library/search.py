"""What was found across all inspections."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date, datetime

from pydantic import BaseModel

from app.search.search import Followed, History, Past
from app.storage.database.tables import IndexedDefect, IndexedInspection
from app.storage.index.asset_index import Asset, Project
from app.storage.index.defect_index import FoundDefect
from app.survey.assets.asset_history import Change, Trace
from app.survey.assets.search_terms import Problem
from app.survey.catalogue import labels_of
from app.survey.distances.film_quality import problems_of
from app.web.schemas.out import Out


class FoundDefectOut(Out):
    """An observation of any inspection."""

    inspection_id: str
    inspection: str
    project: str | None
    asset: str | None
    surveyed_on: date
    """Day of the survey, by the header; else when the inspection was made."""
    revision: int
    """Revision of the inspection whose corrections gave the distance."""
    observation_id: str
    seq: int
    frame: int
    code: str | None
    char1: str | None
    char2: str | None
    label: str | None
    label_ms: str | None
    labels: dict[str, str]
    """In other languages than that of `label`, as far as they are known."""
    severity: int | None
    continuous: str | None
    distance_m: float | None
    distance_u95_m: float | None
    clock: int | None
    clock_to: int | None
    remark: str | None
    photo: bool
    created_at: datetime

    @classmethod
    def of(cls, found: FoundDefect) -> FoundDefectOut:
        """Convert the row of the index."""
        return cls.read_from(found.row, labels=_labels(found.row), photo=found.has_photo)


class FoundDefectsOut(BaseModel):
    """A page of the defects that fit."""

    total: int
    pending: int
    """Inspections that are not indexed in their present state, so that the answer may lack them."""
    defects: list[FoundDefectOut]


class AssetsOut(BaseModel):
    """A page of the assets."""

    total: int
    pending: int
    assets: list[Asset]


class ProjectsOut(BaseModel):
    """A page of the projects."""

    total: int
    pending: int
    projects: list[Project]


class SurveyOut(Out):
    """An inspection in the history of its asset."""

    id: str
    name: str
    project: str | None
    at: date
    direction: str | None
    status: str
    length_m: float | None
    """Corrected distance of the end."""
    length_u95_m: float | None
    is_useful: bool | None
    """Whether that is as narrow as `/api/intended-use` asks for; None if nobody measured it."""
    worst_severity: int | None
    has_film: bool
    """Whether there is a thumbnail."""
    labels: list[str]
    changes: dict[Change, int]
    """Number of defects with each change that this survey shows."""
    defects: list[FoundDefectOut]

    @classmethod
    def of(cls, past: Past) -> SurveyOut:
        """Convert the rows of the index."""
        row, inspection = past.found.row, past.found.inspection
        direction = inspection.header.get("direction")
        return cls.read_from(
            row,
            inspection,
            past,
            id=row.inspection_id,
            at=row.surveyed_on,
            direction=None if direction is None else str(direction),
            length_m=row.distance_m,
            length_u95_m=row.distance_u95_m,
            defects=[FoundDefectOut.of(defect) for defect in past.defects],
        )


class SightingOut(Out):
    """A defect in one of the surveys."""

    inspection_id: str
    observation_id: str
    severity: int | None


class GrowthOut(Out):
    """What is larger than when it was stated before."""

    quantity: str
    """severity, quant1 or quant2."""
    before: float
    after: float
    unit: str | None
    """Unit of a quantity: mm, %, deg, ppm or count."""


class TraceOut(Out):
    """One defect through the surveys: the same code near the same place."""

    code: str
    label: str | None
    label_ms: str | None
    labels: dict[str, str]
    distance_m: float
    """By the newest survey that saw it, like code and clock."""
    distance_u95_m: float | None
    clock: int | None
    first_severity: int | None
    last_severity: int | None
    has_grown: bool
    """Whether it is more severe than when it was first seen."""
    change: Change
    """What the newest survey that covered its place shows."""
    changes: list[Change | None]
    """What each survey shows; null for nothing."""
    growth: GrowthOut | None
    """From the sightings before to the last one."""
    first_at: date
    last_at: date
    seen: list[SightingOut]
    """Oldest first."""

    @classmethod
    def of(cls, followed: Followed, rows: Mapping[tuple[str, str], FoundDefect]) -> TraceOut:
        """Convert a trace; `rows` are the defects by inspection and observation."""
        trace, last = followed.trace, followed.trace.seen[-1]
        shown = [change for change in followed.changes if change is not None]
        row = rows[last.inspection_id, last.observation_id].row
        return cls.read_from(
            last,
            trace,
            followed,
            row,
            labels=_labels(row),
            distance_u95_m=last.u95_m,
            change=shown[-1],
            growth=_growth(trace, row),
            first_at=trace.days[0],
            last_at=trace.days[-1],
        )


class HistoryOut(Out):
    """The inspections of an asset, oldest first, and what became of its defects."""

    asset: str
    also_written: list[str]
    """Other ids with the same letters and digits: probably the same asset."""
    total: int
    """Number of its inspections; the newest of them follow."""
    pending: int
    inspections: list[SurveyOut]
    traces: list[TraceOut]
    """Every defect once, by its newest distance."""

    @classmethod
    def of(cls, asset: str, history: History, pending: int) -> HistoryOut:
        """Convert the service's result."""
        rows = {
            (one.row.inspection_id, one.row.observation_id): one
            for past in history.inspections
            for one in past.defects
        }
        return cls.read_from(
            history,
            asset=asset,
            pending=pending,
            inspections=[SurveyOut.of(past) for past in history.inspections],
            traces=[TraceOut.of(one, rows) for one in history.followed],
        )


def _growth(trace: Trace, row: IndexedDefect) -> GrowthOut | None:
    growth = trace.growth
    if growth is None:
        return None
    unit = {"quant1": row.unit1, "quant2": row.unit2}.get(growth.quantity)
    return GrowthOut.read_from(growth, unit=unit)


class FilmOut(Out):
    """How suitable a film was for measuring: shares of its frames, from 0 to 1."""

    inspection_id: str
    name: str
    project: str | None
    asset: str | None
    surveyed_on: date
    frames: int
    weak_share: float
    lost_share: float
    too_fast_share: float | None
    """None where the health of the pictures was not measured, like the next ones."""
    dark_share: float | None
    overexposed_share: float | None
    blurred_share: float | None
    dirty_lens_share: float | None
    problems: list[Problem]
    """What more frames have than the checks of a report let pass."""

    @classmethod
    def of(cls, row: IndexedInspection) -> FilmOut:
        """Convert the row of the index."""
        return cls.read_from(row, problems=problems_of(vars(row)))


class FilmsOut(BaseModel):
    """A page of the measured films."""

    total: int
    pending: int
    films: list[FilmOut]


def _labels(row: IndexedDefect) -> dict[str, str]:
    """Return the label in other languages; the index has the Malay one of imported packs, too."""
    indexed = {"ms": row.label_ms} if row.label_ms else {}
    return {**labels_of(row.label), **indexed}
