"""What may be asked of the search over all inspections."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from typing import Generic, Literal, TypeVar

from app.survey.assets.box import Box

Problem = Literal["lost", "too_fast", "too_dark", "overexposed", "blurred", "lens_dirty"]
"""What is wrong with a film; `app.survey.distances.film_quality` decides it."""
DefectSort = Literal[
    "created_at", "surveyed_on", "severity", "code", "distance_m", "inspection", "asset", "project"
]
QualitySort = Literal[
    "name", "surveyed_on", "frames", "weak_share", "lost_share", "too_fast_share", "dark_share",
    "overexposed_share", "blurred_share", "dirty_lens_share",
]  # fmt: skip
AssetSort = Literal["asset", "project", "inspections", "last_on", "worst_severity"]
ProjectSort = Literal[
    "project", "assets", "inspections", "done", "approved", "last_on", "worst_severity"
]
"""Columns of the index by which a list may be sorted."""
InspectionSort = Literal[
    "created_at", "name", "status", "review_state", "project", "asset", "surveyed_on",
    "distance_m", "defects", "worst_severity",
]  # fmt: skip
"""Columns of the inspection, then of the index; none is in both but the name."""
WorkState = Literal["to_do", "live", "recorded", "in_review", "issued"]
WORK_STATES: tuple[WorkState, ...] = ("to_do", "live", "recorded", "in_review", "issued")
"""How far the inspection of a section is, in the order of the job."""
WorkSort = Literal["state", "asset", "project", "last_on", "worst_severity", "due_on"]
OrderFilter = Literal["open", "overdue"]
"""Sections with a work order that has not ended; those of them whose day is past."""
Sort = TypeVar("Sort")


@dataclass(frozen=True, kw_only=True)
class Page(Generic[Sort]):
    """Which rows of a sorted list are wanted."""

    sort: Sort
    descending: bool
    offset: int
    limit: int


@dataclass(frozen=True, kw_only=True)
class DefectFilter:
    """Which defects are wanted; None and "" want all."""

    code: str | None = None
    """Beginning of the code."""
    severity_from: int | None = None
    text: str = ""
    """Words that all occur, in any order, without regard to case and accents."""
    project: str | None = None
    asset: str | None = None
    from_m: float | None = None
    to_m: float | None = None
    clock_hours: int | None = None
    """Hours of which the defect covers at least one, as bits."""
    after: date | None = None
    """First day of the surveys, and the last one."""
    before: date | None = None


@dataclass(frozen=True, kw_only=True)
class ProjectFilter:
    """Which project is wanted: one, what belongs to none, or any."""

    name: str | None = None
    is_none: bool = False

    @property
    def is_set(self) -> bool:
        """Whether it narrows anything."""
        return self.is_none or self.name is not None


@dataclass(frozen=True, kw_only=True)
class AssetFilter:
    """Which assets are wanted."""

    text: str = ""
    """Words that all occur in what the register says of it, or in the names of an inspection."""
    of: ProjectFilter = ProjectFilter()


@dataclass(frozen=True, kw_only=True)
class WorkFilter:
    """Which sections of the register are wanted."""

    text: str = ""
    """Words that all occur in what the register says of it."""
    of: ProjectFilter = ProjectFilter()
    state: WorkState | None = None
    orders: OrderFilter | None = None


@dataclass(frozen=True, kw_only=True)
class InspectionFilter:
    """Which inspections are wanted; None and "" want all."""

    search: str = ""
    """Words that all occur in the name, the file's name or one of the searched header fields."""
    status: str | None = None
    review: str | None = None
    of: ProjectFilter = ProjectFilter()
    asset: str | None = None
    severity_from: int | None = None
    """Least severity of the worst defect."""
    label: str | None = None
    outdated: bool = False
    """Only those whose film an older program tracked."""


@dataclass(frozen=True, kw_only=True)
class FeatureFilter:
    """Which assets, inspections or observations a map of another program wants; None wants all."""

    box: Box | None = None
    first: date | None = None
    """First day of the surveys, and the last one."""
    last: date | None = None
    project: str | None = None
    asset: str | None = None
    code: str | None = None
    key: tuple[str, ...] | None = None
    """Of the only one that is wanted."""
