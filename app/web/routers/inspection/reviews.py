"""The review of an inspection: its state, and remarks on observations."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path

from app import errors
from app.inspections.acceptance import Acceptance
from app.inspections.reviews import Reviews
from app.web.deps import OBSERVATION_ID, InspectionId, PrincipalDep, Service, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.inspection.reviews import RemarkIn, ReplyIn, ReviewIn, ReviewOut, SettledIn

router = APIRouter(prefix="/api/inspections/{inspection_id}/review", tags=["review"])

RemarkId = Annotated[str, Path(pattern=OBSERVATION_ID)]


@router.get("")
@viewer
def get(inspection_id: InspectionId, reviews: Service[Reviews]) -> ReviewOut:
    """Return the state of the review, how it was reached, and the remarks."""
    return ReviewOut.whole(reviews.get(inspection_id))


@router.post(
    "",
    responses=failures(errors.StillRunning, errors.WrongReviewState, errors.OpenQuestions),
)
@operator
def move(
    inspection_id: InspectionId, body: ReviewIn, reviews: Service[Reviews], principal: PrincipalDep
) -> ReviewOut:
    """Set the state; only admins approve, and reopen what is approved. May be repeated."""
    reviews.move(inspection_id, body.state, principal, body.reason)
    return ReviewOut.whole(reviews.get(inspection_id))


@router.put(
    "/remarks/{remark_id}",
    responses=failures(
        errors.ObservationNotFound, errors.InspectionLocked, errors.ChangedMeanwhile
    ),
)
@operator
def remark(
    inspection_id: InspectionId,
    remark_id: RemarkId,
    body: RemarkIn,
    reviews: Service[Reviews],
    principal: PrincipalDep,
) -> ReviewOut:
    """Add a remark on an observation. May be repeated: one that exists stays as it is."""
    reviews.remark(
        inspection_id,
        remark_id,
        body.observation,
        body.kind,
        body.text,
        principal.name,
        seen=body.version,
    )
    return ReviewOut.whole(reviews.get(inspection_id))


@router.put(
    "/remarks/{remark_id}/settled",
    responses=failures(errors.RemarkNotFound, errors.InspectionLocked),
)
@operator
def settle(
    inspection_id: InspectionId,
    remark_id: RemarkId,
    body: SettledIn,
    reviews: Service[Reviews],
    principal: PrincipalDep,
) -> ReviewOut:
    """Settle a question, or open it again."""
    reviews.settle(inspection_id, remark_id, principal.name, is_settled=body.settled)
    return ReviewOut.whole(reviews.get(inspection_id))


@router.put("/said/{answer_id}", responses=failures(errors.AnswerNotFound))
@operator
def reply(
    inspection_id: InspectionId,
    answer_id: RemarkId,
    body: ReplyIn,
    reviews: Service[Reviews],
    acceptance: Service[Acceptance],
    principal: PrincipalDep,
) -> ReviewOut:
    """Answer what a client said by a link, who sees it there; also where the inspection is
    approved, because it changes nothing of it.
    """
    acceptance.reply(inspection_id, answer_id, body.reply, principal.name)
    return ReviewOut.whole(reviews.get(inspection_id))


@router.delete("/remarks/{remark_id}", responses=failures(errors.InspectionLocked))
@operator
def withdraw(
    inspection_id: InspectionId,
    remark_id: RemarkId,
    reviews: Service[Reviews],
    principal: PrincipalDep,
) -> ReviewOut:
    """Remove a remark; only its author or an admin may. May be repeated."""
    reviews.withdraw(inspection_id, remark_id, principal)
    return ReviewOut.whole(reviews.get(inspection_id))
