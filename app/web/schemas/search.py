"""What was found across all inspections."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date, datetime

from pydantic import BaseModel

from app.search.search import Followed, History, Past
from app.storage.database.tables import IndexedDefect, IndexedInspection
from app.storage.index.asset_index import Asset, Project
from app.storage.index.defect_index import FoundDefect
from app.survey.asset_history import Change, Trace
from app.survey.catalogue import labels_of
from app.survey.film_quality import problems_of
from app.survey.search_terms import Problem


class FoundDefectOut(BaseModel):
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
        indexed = cls.model_fields.keys() - {"labels", "photo"}
        row = {name: getattr(found.row, name) for name in indexed}
        return cls(**row, labels=_labels(found.row), photo=found.has_photo)


class FoundDefectsOut(BaseModel):
    """A page of the defects that fit."""

    total: int
    pending: int
    """Inspections that are not indexed in their present state, so that the answer may lack them."""
    defects: list[FoundDefectOut]


class AssetOut(BaseModel):
    """An asset with its inspections in figures."""

    asset: str
    project: str | None
    """Of the register, else of its newest survey."""
    inspections: int
    last_at: date | None
    """None if it was never inspected."""
    worst_severity: int | None
    """Of its newest survey: of all of that day, but not of a film that was not tracked yet."""
    filmed_id: str | None
    """Id of that survey if its film is here, for its thumbnail."""
    is_registered: bool
    also_written: list[str]
    """Other ids with the same letters and digits: probably the same asset."""

    @classmethod
    def of(cls, asset: Asset) -> AssetOut:
        """Convert the result of the index."""
        return cls(
            asset=asset.asset,
            project=asset.project,
            inspections=asset.inspections,
            last_at=asset.last_on,
            worst_severity=asset.worst_severity,
            filmed_id=asset.filmed_id,
            is_registered=asset.is_registered,
            also_written=list(asset.also_written),
        )


class AssetsOut(BaseModel):
    """A page of the assets."""

    total: int
    pending: int
    assets: list[AssetOut]


class ProjectOut(BaseModel):
    """A project with its inspections in figures."""

    project: str | None
    """None for all that belongs to no project."""
    assets: int
    inspections: int
    done: int
    approved: int
    last_at: date | None
    worst_severity: int | None
    """Of the newest survey of each of its assets."""

    @classmethod
    def of(cls, project: Project) -> ProjectOut:
        """Convert the result of the index."""
        return cls(
            project=project.project,
            assets=project.assets,
            inspections=project.inspections,
            done=project.done,
            approved=project.approved,
            last_at=project.last_on,
            worst_severity=project.worst_severity,
        )


class ProjectsOut(BaseModel):
    """A page of the projects."""

    total: int
    pending: int
    projects: list[ProjectOut]


class SurveyOut(BaseModel):
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
        return cls(
            id=row.inspection_id,
            name=row.name,
            project=row.project,
            at=row.surveyed_on,
            direction=None if direction is None else str(direction),
            status=inspection.status,
            length_m=row.distance_m,
            length_u95_m=row.distance_u95_m,
            worst_severity=row.worst_severity,
            has_film=inspection.has_film,
            labels=list(past.labels),
            changes=past.changes,
            defects=[FoundDefectOut.of(defect) for defect in past.defects],
        )


class SightingOut(BaseModel):
    """A defect in one of the surveys."""

    inspection_id: str
    observation_id: str
    severity: int | None


class GrowthOut(BaseModel):
    """What is larger than when it was stated before."""

    quantity: str
    """severity, quant1 or quant2."""
    before: float
    after: float
    unit: str | None
    """Unit of a quantity: mm, %, deg, ppm or count."""


class TraceOut(BaseModel):
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
        return cls(
            code=last.code,
            label=row.label,
            label_ms=row.label_ms,
            labels=_labels(row),
            distance_m=last.distance_m,
            distance_u95_m=last.u95_m,
            clock=last.clock,
            first_severity=trace.first_severity,
            last_severity=trace.last_severity,
            has_grown=trace.has_grown,
            change=shown[-1],
            changes=followed.changes,
            growth=_growth(trace, row),
            first_at=trace.days[0],
            last_at=trace.days[-1],
            seen=[
                SightingOut(
                    inspection_id=one.inspection_id,
                    observation_id=one.observation_id,
                    severity=one.severity,
                )
                for one in trace.seen
            ],
        )


class HistoryOut(BaseModel):
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
        return cls(
            asset=asset,
            also_written=list(history.also_written),
            total=history.total,
            pending=pending,
            inspections=[SurveyOut.of(past) for past in history.inspections],
            traces=[TraceOut.of(one, rows) for one in history.followed],
        )


def _growth(trace: Trace, row: IndexedDefect) -> GrowthOut | None:
    growth = trace.growth
    if growth is None:
        return None
    unit = {"quant1": row.unit1, "quant2": row.unit2}.get(growth.quantity)
    return GrowthOut(quantity=growth.quantity, before=growth.before, after=growth.after, unit=unit)


class FilmOut(BaseModel):
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
        values = {name: getattr(row, name) for name in cls.model_fields if name != "problems"}
        return cls(**values, problems=problems_of(values))


class FilmsOut(BaseModel):
    """A page of the measured films."""

    total: int
    pending: int
    films: list[FilmOut]


def _labels(row: IndexedDefect) -> dict[str, str]:
    """Return the label in other languages; the index has the Malay one of imported packs, too."""
    indexed = {"ms": row.label_ms} if row.label_ms else {}
    return {**labels_of(row.label), **indexed}
