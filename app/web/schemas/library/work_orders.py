"""Work orders."""

from __future__ import annotations

from collections import Counter
from datetime import date, datetime
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, StringConstraints

from app.inspections.work_orders import OrderImport, Orders, OrderView
from app.survey.assets.order_table import FIELDS, Reason
from app.survey.assets.register import LONGEST_ID, Asset
from app.survey.assets.register_table import fault_of_id
from app.survey.assets.work_orders import (
    LONGEST_NUMBER,
    LONGEST_TEXT,
    Action,
    End,
    Order,
    State,
    Step,
)
from app.survey.given import LINE, TEXT, Given
from app.web.schemas.library.register import AssetIn
from app.web.schemas.out import Out

_SHOWN = 200
"""Rows and faults of an answer."""


def _an_id(asset_id: str) -> str:
    if fault := fault_of_id(asset_id):
        raise ValueError(fault)
    return asset_id


def _a_day(text: str) -> str:
    date.fromisoformat(text)
    return text


_Text = Annotated[
    str, StringConstraints(strip_whitespace=True, max_length=LONGEST_TEXT, pattern=TEXT)
]
_Line = StringConstraints(strip_whitespace=True, min_length=1, pattern=LINE)


class WorkOrderIn(Given):
    """What an office orders for one asset."""

    number: Annotated[str, _Line, Field(max_length=LONGEST_NUMBER)] = Field(
        description="The office's own; one order may have many assets, each sent by itself."
    )
    asset_id: Annotated[str, _Line, Field(max_length=LONGEST_ID), AfterValidator(_an_id)]
    reason: _Text = ""
    due_on: (
        Annotated[str, StringConstraints(pattern=r"^\d{4}-\d\d-\d\d$"), AfterValidator(_a_day)]
        | None
    ) = None
    note: _Text = ""
    asset_data: AssetIn | None = Field(
        None,
        description="What the register takes up if it does not have the asset; without it, an "
        "unknown asset is refused.",
    )

    def to_order(self) -> Order:
        """Return the order."""
        due_on = None if self.due_on is None else date.fromisoformat(self.due_on)
        return Order(
            number=self.number,
            asset_id=self.asset_id,
            reason=self.reason,
            due_on=due_on,
            note=self.note,
        )

    def to_asset(self) -> Asset | None:
        """Return the asset, if its data are given."""
        data = self.asset_data
        return None if data is None else data.to_asset(self.asset_id)


class WorkOrderOut(Out):
    """A work order of one asset, and how far it is."""

    id: str
    number: str
    asset_id: str
    project: str | None
    """Of the asset in the register."""
    reason: str
    due_on: date | None
    note: str
    state: State
    """Derived from the inspections of the asset, until the order is closed or cancelled."""
    inspection_id: str | None
    """The inspection that the state is of."""
    changed: int
    """Rises with every change of any order: a cursor for `since`."""
    changed_at: datetime
    ordered_at: datetime
    ordered_by: str
    ended_by: str | None

    @classmethod
    def of(cls, view: OrderView) -> Self:
        """Convert the service's view."""
        return cls.read_from(view.row, view)


class WorkOrdersOut(Out):
    """Work orders, the earliest change first."""

    orders: list[WorkOrderOut]
    cursor: int
    """For `since` of the next request."""
    has_more: bool

    @classmethod
    def of(cls, found: Orders) -> Self:
        """Convert the service's answer."""
        return cls.read_from(found, orders=[WorkOrderOut.of(view) for view in found.orders])


class EndIn(Given):
    """How an order ends."""

    state: End


class OrderFaultOut(Out):
    """What is wrong in one place of a table."""

    row: int
    """Number of the line in the file."""
    column: str | None
    detail: str
    reason: Reason


class OrderColumnOut(Out):
    """A column of a table, and what it holds."""

    name: str
    examples: list[str]
    field: Literal["number", "asset_id", "reason", "due_on", "project", "note"] | None
    """Null if it is not used."""


class OrderRowOut(Out):
    """What the import of a row does."""

    row: int
    action: Action
    is_new_asset: bool
    number: str
    asset_id: str
    reason: str
    due_on: date | None

    @classmethod
    def of(cls, step: Step) -> Self:
        """Convert the step."""
        return cls.read_from(step, step.order)


class OrderImportOut(Out):
    """What an import did, or would do; rows with faults are left out."""

    added: int
    changed: int
    same: int
    new_assets: int
    """Assets that the register gets."""
    faulty: int
    """Rows with faults."""
    faults: list[OrderFaultOut]
    """The first 200, like rows."""
    rows: list[OrderRowOut]
    columns: list[OrderColumnOut]
    fields: list[str]
    """What a column may hold."""

    @classmethod
    def of(cls, found: OrderImport) -> Self:
        """Convert the service's answer."""
        done = Counter(step.action for step in found.steps)
        return cls.read_from(
            found,
            fields=list(FIELDS),
            added=done["add"],
            changed=done["change"],
            same=done["same"],
            new_assets=len({step.order.asset_id for step in found.steps if step.is_new_asset}),
            faulty=len({fault.row for fault in found.faults}),
            faults=found.faults[:_SHOWN],
            rows=[OrderRowOut.of(step) for step in found.steps[:_SHOWN]],
        )
