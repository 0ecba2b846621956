"""Work orders of an office: which asset, why, until when; and how far each is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Literal, Protocol

from app.survey.observations.review import APPROVED

State = Literal[
    "ordered", "in_progress", "inspected", "delivered", "accepted", "closed", "cancelled"
]
STATES: tuple[State, ...] = (
    "ordered", "in_progress", "inspected", "delivered", "accepted", "closed", "cancelled",
)  # fmt: skip
"""In the order of the job; the last two are stated by a person and end an order."""
End = Literal["closed", "cancelled"]
ENDS: tuple[End, ...] = ("closed", "cancelled")
LONGEST_NUMBER, LONGEST_TEXT = 100, 2000

Action = Literal["add", "change", "same"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Order:
    """What an office states of one asset of an order."""

    number: str
    asset_id: str
    reason: str = ""
    due_on: date | None = None
    note: str = ""
    project: str | None = None
    """Of the asset, if it is stated: that of the register, or the one under which it is added."""


@dataclass(frozen=True, slots=True)
class Step:
    """What the import of a row does."""

    row: int
    order: Order
    action: Action
    is_new_asset: bool
    """Whether the asset is added to the register."""


class Inspected(Protocol):
    """An inspection of the asset, as far as the state of an order depends on it."""

    @property
    def id(self) -> str:
        """Its id."""

    @property
    def status(self) -> str:
        """As `app.storage.database.tables` has it."""

    @property
    def review_state(self) -> str:
        """State of its review."""

    @property
    def created_at(self) -> datetime:
        """When it was made."""

    @property
    def header(self) -> Mapping[str, object]:
        """Its header, which may name an order as `client_job_ref`."""


def counted(
    number: str, ordered_at: datetime, others: Iterable[str], inspections: Sequence[Inspected]
) -> Inspected | None:
    """Return the newest inspection of the asset that counts for an order: made since it was
    ordered, and not for another order of the same asset, which its header names.
    """
    of_others = set(others) - {number}
    fit = [
        one
        for one in inspections
        if one.created_at >= ordered_at and one.header.get("client_job_ref") not in of_others
    ]
    return max(fit, key=lambda one: (one.created_at, one.id), default=None)


def state_of(inspected: Inspected | None, *, is_shown: bool, is_accepted: bool) -> State:
    """Return how far an order is that has not ended.

    Args:
        inspected: The inspection that counts for it.
        is_shown: Whether a client was given a link to it.
        is_accepted: Whether the client has accepted it as it is.
    """
    if inspected is None:
        return "ordered"
    if inspected.status not in ("done", "cancelled"):  # one that failed is still to do
        return "in_progress"
    if is_accepted:
        return "accepted"
    return "delivered" if is_shown or inspected.review_state == APPROVED else "inspected"
