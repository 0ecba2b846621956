"""Statements about distances, report checks, the history, and notifications."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from app import errors
from app.alerts.webhook import Webhook
from app.inspections.checks import Checks
from app.inspections.corrections import Corrections
from app.inspections.observations import Observations
from app.reports.content.translator import Translator
from app.survey.distances.stated import Stated
from app.survey.given import PackId
from app.survey.observations.checks import Issue
from app.web.deps import OBSERVATION_ID, InspectionId, PrincipalDep, Service, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.inspection.corrections import CorrectionsIn, CorrectionsOut, IntervalOut
from app.web.schemas.inspection.records import (
    AlertOut,
    AlertsOut,
    EventOut,
    EventsOut,
    IssueOut,
    IssuesOut,
)
from app.web.versions import Replaced, tag_with
from vo_core.errors import InvalidCorrection

router = APIRouter(prefix="/api/inspections/{inspection_id}", tags=["corrections"])


@router.get("/corrections")
@viewer
def get(
    inspection_id: InspectionId, corrections: Service[Corrections], response: Response
) -> CorrectionsOut:
    """Return the current statements and their result."""
    corrected = corrections.get(inspection_id)
    tag_with(response, corrected.version)
    return CorrectionsOut.of(corrected)


@router.put(
    "/corrections",
    responses=failures(errors.InspectionLocked, InvalidCorrection, errors.ChangedMeanwhile),
)
@operator
def put(
    inspection_id: InspectionId,
    body: CorrectionsIn,
    corrections: Service[Corrections],
    principal: PrincipalDep,
    replaced: Replaced,
    response: Response,
) -> CorrectionsOut:
    """Replace all statements; to undo, send the earlier ones."""
    corrected = corrections.put(
        inspection_id, body.stated(), body.remark, principal.name, replaced=replaced
    )
    tag_with(response, corrected.version)
    return CorrectionsOut.of(corrected)


@router.post("/corrections/preview")
@viewer
def preview(
    inspection_id: InspectionId, body: Stated, corrections: Service[Corrections]
) -> CorrectionsOut:
    """Return the result of other statements without storing them."""
    return CorrectionsOut.of(corrections.preview(inspection_id, body))


@router.get("/interval")
@viewer
def interval(
    inspection_id: InspectionId,
    corrections: Service[Corrections],
    frame: Annotated[int | None, Query(ge=0, le=2**31)] = None,
) -> IntervalOut:
    """Return the sources of the interval of a frame, by default the furthest."""
    budget = corrections.budget(inspection_id, frame)
    return IntervalOut.model_validate({"interval": budget})


@router.get("/checks")
@viewer
def checks(inspection_id: InspectionId, checks: Service[Checks]) -> IssuesOut:
    """Return the issues to resolve before a report is issued."""
    return _said(checks.run(inspection_id))


@router.get("/checks/with-pack", responses=failures(errors.PackNotFound))
@viewer
def checks_with_pack(
    inspection_id: InspectionId,
    checks: Service[Checks],
    pack: Annotated[
        PackId | None, Query(description="Id of an imported pack; the built-in one without it.")
    ] = None,
) -> IssuesOut:
    """Return what would no longer fit if the inspection were coded with another pack, or with
    another version of its own.
    """
    return _said(checks.with_pack(inspection_id, pack))


def _said(found: list[Issue]) -> IssuesOut:
    t = Translator("en", "m")
    return IssuesOut(checks=[IssueOut.read_from(one, detail=t.issue(one, {})) for one in found])


@router.get("/events")
@viewer
def events(
    inspection_id: InspectionId,
    observations: Service[Observations],
    observation: Annotated[str | None, Query(pattern=OBSERVATION_ID)] = None,
) -> EventsOut:
    """Return who changed what, the newest first."""
    found = observations.events(inspection_id, observation)
    return EventsOut(events=[EventOut.of(event) for event in reversed(found)])


@router.get("/alerts")
@viewer
def alerts(inspection_id: InspectionId, webhook: Service[Webhook]) -> AlertsOut:
    """Return whether the client was notified of each severity 5, the oldest first."""
    found = webhook.alerts(inspection_id)
    return AlertsOut(
        is_configured=webhook.is_configured,
        alerts=[AlertOut.of(alert) for alert in found],
    )
