"""Templates of reports: one for each project that has its own, one for all others."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response

from app import errors
from app.reports.template import ReportTemplate
from app.reports.templates import ReportTemplates
from app.survey.given import LINE
from app.web.deps import InspectionId, PrincipalDep, Service, of_projects, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.report_templates import (
    ListedTemplateOut,
    ReportTemplateOut,
    ReportTemplatesOut,
)
from app.web.versions import Replaced, tag_with

router = APIRouter(prefix="/api", tags=["reports"])

Project = Annotated[
    str,
    Path(
        max_length=200,
        pattern=LINE,
        description="Name of a project; empty: all projects without a template of their own.",
    ),
]


@router.get("/report-templates")
@viewer
@of_projects
def every(report_templates: Service[ReportTemplates]) -> ReportTemplatesOut:
    """Return who has a template."""
    return ReportTemplatesOut(
        templates=[
            ListedTemplateOut(
                project=row.project, changed_at=row.changed_at, changed_by=row.changed_by
            )
            for row in report_templates.listed()
        ]
    )


@router.get("/report-templates/{project:path}")
@viewer
@of_projects
def get(
    project: Project, report_templates: Service[ReportTemplates], response: Response
) -> ReportTemplateOut:
    """Return the template that the reports of a project use: its own, or else the one in whose
    `project` it is.
    """
    used = report_templates.of_project(project)
    tag_with(response, used.version)
    return ReportTemplateOut.model_validate(used)


@router.put("/report-templates/{project:path}", responses=failures(errors.ChangedMeanwhile))
@operator
@of_projects
def put(
    project: Project,
    body: ReportTemplate,
    report_templates: Service[ReportTemplates],
    principal: PrincipalDep,
    replaced: Replaced,
    response: Response,
) -> ReportTemplateOut:
    """Give a project its own template, or replace it."""
    used = report_templates.put(project, body, principal.name, replaced)
    tag_with(response, used.version)
    return ReportTemplateOut.model_validate(used)


@router.delete(
    "/report-templates/{project:path}", status_code=204, responses=failures(errors.ChangedMeanwhile)
)
@operator
@of_projects
def delete(
    project: Project,
    report_templates: Service[ReportTemplates],
    principal: PrincipalDep,
    replaced: Replaced,
) -> None:
    """Take a project's own template away, if it has one."""
    report_templates.delete(project, principal.name, replaced)


@router.get("/inspections/{inspection_id}/report-template")
@viewer
def of_inspection(
    inspection_id: InspectionId, report_templates: Service[ReportTemplates], response: Response
) -> ReportTemplateOut:
    """Return the template that the reports of an inspection use."""
    used = report_templates.of_inspection(inspection_id)
    tag_with(response, used.version)
    return ReportTemplateOut.model_validate(used)
