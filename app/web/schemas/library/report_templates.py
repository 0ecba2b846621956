"""Templates of reports."""

from __future__ import annotations

from datetime import datetime

from pydantic import BaseModel

from app.reports.template import ReportTemplate
from app.web.schemas.out import Out


class ReportTemplateOut(Out):
    """The template of a project's or an inspection's reports."""

    project: str | None
    """The project that has it; empty: it serves every project without its own; null: nobody has
    made one, and these are the defaults."""
    template: ReportTemplate
    changed_at: datetime | None
    changed_by: str | None
    version: str
    """The `ETag` of the template."""


class ListedTemplateOut(BaseModel):
    """Who has a template, without its content."""

    project: str
    """Empty: every project without its own."""
    changed_at: datetime
    changed_by: str


class ReportTemplatesOut(BaseModel):
    """The templates, sorted by project."""

    templates: list[ListedTemplateOut]
