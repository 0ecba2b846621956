"""The templates of reports in the database: one for each project that has its own, one for all
others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session, load_only

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import ReportTemplateRow
from app.survey.versions import Require

EVERY_OTHER = ""
"""The project of the template of all projects without their own."""


class ReportTemplateStore(Store):
    """Returns detached rows."""

    @reading
    def listed(self, session: Session) -> list[ReportTemplateRow]:
        """Return all rows by project, without their contents, which may hold logos."""
        rows = ReportTemplateRow
        query = (
            select(rows)
            .options(load_only(rows.project, rows.changed_at, rows.changed_by, raiseload=True))
            .order_by(rows.project)
        )
        return list(session.scalars(query))

    @reading
    def best(self, session: Session, projects: Sequence[str]) -> ReportTemplateRow | None:
        """Return the first of these projects' templates that is there."""
        query = select(ReportTemplateRow).where(ReportTemplateRow.project.in_(projects))
        found = {row.project: row for row in session.scalars(query)}
        return next((found[project] for project in projects if project in found), None)

    @writing
    def put(
        self, session: Session, project: str, content: Mapping[str, Any], who: str, require: Require
    ) -> ReportTemplateRow:
        """Add the template of a project, or replace it.

        Raises:
            Exception: Whatever `require` raises for the stored content, None if there is none.
        """
        row = session.get(ReportTemplateRow, project)
        require(None if row is None else row.content)
        return session.merge(
            ReportTemplateRow(
                project=project,
                content=dict(content),
                changed_at=datetime.now(UTC),
                changed_by=who,
            )
        )

    @writing
    def delete(self, session: Session, project: str, require: Require) -> None:
        """Delete the template of a project, if it has one.

        Raises:
            Exception: Whatever `require` raises for the stored content, None if there is none.
        """
        row = session.get(ReportTemplateRow, project)
        require(None if row is None else row.content)
        if row is not None:
            session.delete(row)
