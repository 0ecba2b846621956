"""Parameters that several searches and lists take."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Query

from app.survey.assets.search_terms import ProjectFilter
from app.survey.given import LINE

Text = Annotated[
    str,
    Query(
        max_length=200,
        pattern=LINE,
        description="Words that all occur, whatever their case and accents.",
    ),
]
Name = Annotated[str | None, Query(max_length=20_000, pattern=LINE)]
NoProject = Annotated[bool, Query(description="Only what belongs to no project.")]
SeverityFrom = Annotated[int | None, Query(ge=0, le=5)]
Offset = Annotated[int, Query(ge=0, le=10_000_000)]
Limit = Annotated[int, Query(ge=1, le=500)]
Descending = Annotated[bool, Query(description="The highest, newest or last first.")]


def _of_project(project: Name = None, no_project: NoProject = False) -> ProjectFilter:
    return ProjectFilter(name=project, is_none=no_project)


OfProject = Annotated[ProjectFilter, Depends(_of_project)]
