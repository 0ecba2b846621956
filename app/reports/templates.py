"""Keeps the templates of reports, and finds the one that an inspection's reports use."""

from __future__ import annotations

import base64
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from pydantic import ValidationError

from app.errors import InvalidImport, InvalidRequest
from app.pictures import MOST_LOGO_PX, UnusablePicture, require_picture
from app.reports.report import Company
from app.reports.template import DEFAULT_TEMPLATE, ReportTemplate
from app.storage.database.tables import ReportTemplateRow
from app.storage.records.inspections import InspectionStore
from app.storage.records.report_templates import EVERY_OTHER, ReportTemplateStore
from app.survey.fields.header import project_of
from app.survey.versions import require_version, version_of

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Used:
    """A template with whose it is."""

    template: ReportTemplate
    project: str | None
    """The project that has it; empty: every project without its own; None: nobody has made one."""
    changed_at: datetime | None = None
    changed_by: str | None = None

    @property
    def version(self) -> str:
        """Version of the content, which guards against changes of others."""
        return version_of(_plain(self.template))


class ReportTemplates:
    """Reads and changes templates."""

    def __init__(
        self, store: ReportTemplateStore, inspections: InspectionStore, company: Company
    ) -> None:
        self._store = store
        self._inspections = inspections
        self.company = company
        """The server's."""

    def listed(self) -> list[ReportTemplateRow]:
        """Return the projects that have a template, sorted by name; the rows have no content."""
        return self._store.listed()

    def of_project(self, project: str | None) -> Used:
        """Return the template of a project's reports: its own, else that of all others, else the
        one without any choice.
        """
        row = self._store.best([project or EVERY_OTHER, EVERY_OTHER])
        return Used(DEFAULT_TEMPLATE, None) if row is None else _used(row)

    def of_inspection(self, inspection_id: str) -> Used:
        """Return the template that the reports of an inspection use.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return self.of_project(project_of(self._inspections.get(inspection_id).header))

    def put(self, project: str, template: ReportTemplate, who: str, replaced: str | None) -> Used:
        """Give a project its own template, or replace it; empty: of all others.

        Args:
            project: The project.
            template: Its template.
            who: Who changes it.
            replaced: Version of what the project used when it was edited; None replaces any.

        Raises:
            InvalidRequest: The logo is no picture that can be printed.
            ChangedMeanwhile: It uses another version by now; nothing was stored.
        """
        require_logo(template.logo)
        yours = _plain(template)
        common = self.of_project(EVERY_OTHER).version

        def require(stored: dict[str, Any] | None) -> None:
            is_first = stored is None and replaced == common
            if not is_first:
                require_version(_known(stored), yours, replaced)

        row = self._store.put(project, yours, who, require)
        logger.info("%s changed the report template of project %r.", who, project)
        return _used(row)

    def delete(self, project: str, who: str, replaced: str | None) -> None:
        """Take a project's own template away: its reports use that of all others again.

        Raises:
            ChangedMeanwhile: The stored version is no longer `replaced`; nothing was deleted.
        """

        def require(stored: dict[str, Any] | None) -> None:
            require_version(_known(stored), None, replaced)

        self._store.delete(project, require)
        logger.info("%s took the report template of project %r away.", who, project)

    def differing(self, project: str | None, other: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the parts of which another server's template says otherwise than ours.

        Raises:
            InvalidImport: It is no template.
        """
        ours, theirs = self.of_project(project).template, _of_another_server(other)
        ours = ours.model_copy(update={"company_name": company_of(ours, self.company).name or ""})
        differs = {
            name
            for name in ReportTemplate.model_fields
            if getattr(ours, name) != getattr(theirs, name)
        }
        return tuple(part for part, names in _PARTS.items() if differs & names)

    def take(self, project: str | None, other: Mapping[str, Any], who: str) -> bool:
        """Give a project the template of another server, unless anything of it is here already.

        Nobody's grade changes by what somebody imports.
        """
        if project is None or self.of_project(project).project == project:
            return False
        if self._inspections.has_project(project):
            return False
        common = self.of_project(EVERY_OTHER).version
        self.put(project, _of_another_server(other), who, common)
        return True


@dataclass(frozen=True)
class _Logo:
    """A logo within a template, read like a file."""

    content: bytes

    def read_bytes(self) -> bytes:
        """Return the picture."""
        return self.content


def company_of(template: ReportTemplate, server: Company) -> Company:
    """Return the company that issues the reports: the template's, as far as it states one."""
    logo = _Logo(base64.b64decode(template.logo)) if template.logo else server.logo
    name = template.company_name or server.name
    return Company(name, logo, template.company_address, server.server)


def require_logo(logo: str) -> None:
    """Raise InvalidRequest unless a logo, in base64, is empty or a picture of a sensible size."""
    if not logo:
        return
    try:
        require_picture(base64.b64decode(logo), MOST_LOGO_PX)
    except UnusablePicture as error:
        raise InvalidRequest(f"The logo {error}") from error


_PARTS: Mapping[str, frozenset[str]] = {
    "company": frozenset({"company_name", "company_address", "logo"}),
    "texts": frozenset({"introduction", "closing"}),
    "look": frozenset({"accent", "sections"}),
    "grade": frozenset({"grade"}),
    "recommendations": frozenset({"recommendations"}),
    "costs": frozenset({"costs", "currency"}),
}
"""What people call the fields of a template."""


def _of_another_server(content: Mapping[str, Any]) -> ReportTemplate:
    try:
        template = ReportTemplate.kept(dict(content))
        require_logo(template.logo)
    except (ValidationError, InvalidRequest) as error:
        raise InvalidImport("The report template in the file is not what Chainage writes.") from (
            error
        )
    return template


def _used(row: ReportTemplateRow) -> Used:
    return Used(ReportTemplate.kept(row.content), row.project, row.changed_at, row.changed_by)


def _plain(template: ReportTemplate) -> dict[str, Any]:
    return template.model_dump(mode="json")


def _known(stored: dict[str, Any] | None) -> dict[str, Any] | None:
    """Return a stored content in the form of today's templates, so that versions compare."""
    return None if stored is None else _plain(ReportTemplate.kept(stored))
