"""Work orders in the database, with the state that is derived from the inspections."""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from itertools import count
from typing import Any
from uuid import uuid4

from sqlalchemy import delete, func, insert, select
from sqlalchemy.orm import Session

from app.errors import (
    AssetNotFound,
    IdempotencyKeyReused,
    WorkOrderEnded,
    WorkOrderExists,
    WorkOrderNotFound,
)
from app.storage.database.database import Database, batches
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import (
    AcceptanceAnswer,
    AcceptanceSection,
    IdempotentRequest,
    IndexedInspection,
    Inspection,
    RegisteredAsset,
    WorkOrder,
)
from app.storage.records.acceptance import versions_of
from app.storage.records.assets import columns_of
from app.storage.records.notices import note
from app.survey.assets.order_table import Fault
from app.survey.assets.register import Asset
from app.survey.assets.work_orders import ENDS, Action, End, Order, State, Step, counted, state_of
from app.survey.observations.acceptance import standing

EVENT = "work_order.changed"
"""Of the webhook."""
_KEYS_KEPT = timedelta(days=90)


@dataclass(frozen=True)
class OrderView:
    """An order with what the register says of its asset."""

    row: WorkOrder
    project: str | None


@dataclass(frozen=True)
class Orders:
    """Orders in the order of their changes."""

    orders: Sequence[OrderView]
    cursor: int
    """The last change in them: what is newer comes after it."""
    has_more: bool


class WorkOrderStore(Store):
    """Returns detached rows."""

    def __init__(self, database: Database, *, has_webhook: bool) -> None:
        super().__init__(database)
        self._has_webhook = has_webhook

    @writing
    def add(
        self,
        session: Session,
        order: Order,
        asset: Asset | None,
        who: str,
        key: str | None,
        body: Mapping[str, Any],
    ) -> dict[str, Any]:
        """Add an order; return its fields as they were when it was added.

        Args:
            order: What is ordered.
            asset: What the register takes up if it does not have the asset; None: nothing.
            who: Who orders.
            key: Key under which the same request gets the same answer again; None: none.
            body: The request, by which it is known again.
        Raises:
            IdempotencyKeyReused: Another request was answered under the key.
            WorkOrderExists: The number has this asset already.
            AssetNotFound: The register does not have the asset, and `asset` is None.
        """
        now = datetime.now(UTC)
        digest = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
        known = None if key is None else session.get(IdempotentRequest, (who, key))
        if known is not None:
            if known.body_sha256 != digest:
                raise IdempotencyKeyReused(
                    "Another work order was sent with this Idempotency-Key; use a new key."
                )
            return known.answer
        if _existing(session, order.number, order.asset_id) is not None:
            raise WorkOrderExists(
                f"Work order {order.number!r} has the asset {order.asset_id!r} already."
            )
        registered = session.get(RegisteredAsset, order.asset_id)
        if registered is None:
            if asset is None:
                raise AssetNotFound(
                    f"The register has no asset {order.asset_id!r}; add it there, or send "
                    "`asset_data`."
                )
            registered = RegisteredAsset(**columns_of(asset, who, now))
            session.add(registered)
        row = WorkOrder(**_columns(order, who, now, next(_places(session))))
        session.add(row)
        session.flush()
        answer = fields_of(row, registered.project)
        if key is not None:
            old = IdempotentRequest.at < now - _KEYS_KEPT
            session.execute(delete(IdempotentRequest).where(old))
            kept = IdempotentRequest(who=who, key=key, body_sha256=digest, answer=answer, at=now)
            session.add(kept)
        return answer

    @reading
    def planned(
        self, session: Session, stated: Sequence[tuple[int, Order]], *, adds_assets: bool
    ) -> tuple[list[Step], list[Fault]]:
        """Return what an import would do, and the rows that it would leave out."""
        return _planned(session, stated, adds_assets=adds_assets)

    @writing
    def take(
        self,
        session: Session,
        stated: Sequence[tuple[int, Order]],
        who: str,
        *,
        adds_assets: bool,
    ) -> tuple[list[Step], list[Fault]]:
        """Add and change orders, as planned now; return what was done and what was left out."""
        steps, faults = _planned(session, stated, adds_assets=adds_assets)
        now, places = datetime.now(UTC), _places(session)
        new = {step.order.asset_id: step.order for step in steps if step.is_new_asset}
        assets = [columns_of(Asset(one, order.project), who, now) for one, order in new.items()]
        added = [
            _columns(step.order, who, now, next(places)) for step in steps if step.action == "add"
        ]
        if assets:
            session.execute(insert(RegisteredAsset), assets)
        if added:
            session.execute(insert(WorkOrder), added)
        for order in (step.order for step in steps if step.action == "change"):
            row = _existing(session, order.number, order.asset_id)
            assert row is not None  # noqa: S101  (planned in this transaction)
            row.reason, row.due_on, row.note = order.reason, order.due_on, order.note
            self._changed(session, row, next(places))
        return steps, faults

    @reading
    def get(self, session: Session, order_id: str) -> OrderView:
        """Return an order.

        Raises:
            WorkOrderNotFound: No order has this id.
        """
        row = _row(session, order_id)
        return OrderView(row, _project(session, row))

    @reading
    def listed(
        self, session: Session, state: State | None, number: str | None, since: int, limit: int
    ) -> Orders:
        """Return the orders that changed after a cursor, the earliest change first."""
        query = (
            select(WorkOrder, RegisteredAsset.project)
            .outerjoin(RegisteredAsset, RegisteredAsset.asset_id == WorkOrder.asset_id)
            .where(WorkOrder.changed > since)
            .order_by(WorkOrder.changed)
        )
        if state is not None:
            query = query.where(WorkOrder.state == state)
        if number is not None:
            query = query.where(WorkOrder.number == number)
        found = [OrderView(*row) for row in session.execute(query.limit(limit + 1))]
        shown = found[:limit]
        return Orders(shown, shown[-1].row.changed if shown else since, len(found) > limit)

    @writing
    def end(self, session: Session, order_id: str, end: End, who: str) -> OrderView:
        """Close or cancel an order; one that has ended so stays as it is.

        Raises:
            WorkOrderNotFound: No order has this id.
            WorkOrderEnded: It has ended otherwise.
        """
        row = _row(session, order_id)
        if row.state in ENDS and row.state != end:
            raise WorkOrderEnded(f"The work order is {row.state} already.")
        if row.state != end:
            row.state, row.ended_by = end, who
            self._changed(session, row, next(_places(session)))
        return OrderView(row, _project(session, row))

    def follow(self) -> bool:
        """Derive the states of all orders that have not ended; return whether one has changed."""
        with self.database.read() as session:
            derived = _derived(session)
        return bool(derived) and self._store(derived)

    @writing
    def _store(self, session: Session, derived: Mapping[str, tuple[State, str | None]]) -> bool:
        places = _places(session)
        for order_id, (state, inspection_id) in derived.items():
            row = session.get(WorkOrder, order_id)
            if row is not None and row.state not in ENDS:
                row.state, row.inspection_id = state, inspection_id
                self._changed(session, row, next(places))
        return True

    def _changed(self, session: Session, row: WorkOrder, place: int) -> None:
        """Give a changed order its place among the changes, and tell it to the client."""
        row.changed, row.changed_at = place, datetime.now(UTC)
        if self._has_webhook:
            body = {"work_order": fields_of(row, _project(session, row))}
            path = f"/inspections/{row.inspection_id}" if row.inspection_id else "/"
            note(session, EVENT, path, body)


def _places(session: Session) -> Iterator[int]:
    """Yield the next places among the changes; one transaction takes all of its places from it."""
    # Of all orders, those of projects that a limited token does not see included.
    last = session.connection().scalar(select(func.max(WorkOrder.__table__.c.changed)))
    return count((last or 0) + 1)


def _columns(order: Order, who: str, now: datetime, place: int) -> dict[str, Any]:
    """Return the row of a new order."""
    return {
        "id": uuid4().hex,
        "number": order.number,
        "asset_id": order.asset_id,
        "reason": order.reason,
        "due_on": order.due_on,
        "note": order.note,
        "ordered_at": now,
        "ordered_by": who,
        "state": "ordered",
        "changed": place,
        "changed_at": now,
    }


def fields_of(row: WorkOrder, project: str | None) -> dict[str, Any]:
    """Return what programs read of an order, as JSON has it."""
    names = (
        "id", "number", "asset_id", "reason", "due_on", "note", "state", "inspection_id", "changed",
        "changed_at", "ordered_at", "ordered_by", "ended_by",
    )  # fmt: skip
    values = {name: getattr(row, name) for name in names} | {"project": project}
    return {
        name: value.isoformat() if isinstance(value, date | datetime) else value
        for name, value in values.items()
    }


def _row(session: Session, order_id: str) -> WorkOrder:
    row = session.get(WorkOrder, order_id)
    if row is None:
        raise WorkOrderNotFound("There is no such work order.")
    return row


def _project(session: Session, row: WorkOrder) -> str | None:
    asset = session.get(RegisteredAsset, row.asset_id)
    return None if asset is None else asset.project


def _existing(session: Session, number: str, asset_id: str) -> WorkOrder | None:
    return session.scalar(
        select(WorkOrder).where(WorkOrder.number == number, WorkOrder.asset_id == asset_id)
    )


def _planned(
    session: Session, stated: Sequence[tuple[int, Order]], *, adds_assets: bool
) -> tuple[list[Step], list[Fault]]:
    assets = {
        asset_id: project
        for some in batches({order.asset_id for _, order in stated})
        for asset_id, project in session.execute(
            select(RegisteredAsset.asset_id, RegisteredAsset.project).where(
                RegisteredAsset.asset_id.in_(some)
            )
        )
    }
    known = {
        (row.number, row.asset_id): row
        for some in batches({order.number for _, order in stated})
        for row in session.scalars(select(WorkOrder).where(WorkOrder.number.in_(some)))
    }
    steps, faults = [], []
    for line, order in stated:
        row = known.get((order.number, order.asset_id))
        is_new = order.asset_id not in assets
        fault = _fault(line, order, row, assets, adds_assets=adds_assets)
        if fault is not None:
            faults.append(fault)
            continue
        action: Action = "add"
        if row is not None:
            before = (row.reason, row.due_on, row.note)
            action = "same" if before == (order.reason, order.due_on, order.note) else "change"
        steps.append(Step(line, order, action, is_new))
    return steps, faults


def _fault(
    line: int,
    order: Order,
    row: WorkOrder | None,
    assets: Mapping[str, str | None],
    *,
    adds_assets: bool,
) -> Fault | None:
    """Return why an order that is well stated cannot be taken."""
    if row is not None and row.state in ENDS:
        detail = f"order {order.number!r} of this asset is {row.state}; use another number"
        return Fault(line, "number", detail, "ended")
    if order.asset_id not in assets:
        detail = f"the register has no asset {order.asset_id!r}; add it there first"
        return None if adds_assets else Fault(line, "asset_id", detail, "asset")
    if order.project and order.project != assets[order.asset_id]:
        held = assets[order.asset_id]
        where = f"under the project {held!r}" if held else "under no project"
        detail = f"the register has the asset {where}, not {order.project!r}"
        return Fault(line, "project", detail, "project")
    return None


def _derived(session: Session) -> dict[str, tuple[State, str | None]]:
    """Return the states, with their inspections, that differ from what is stored."""
    orders = list(session.scalars(select(WorkOrder).where(WorkOrder.state.not_in(ENDS))))
    inspections: Mapping[str, list[Inspection]] = defaultdict(list)
    numbers: Mapping[str, list[str]] = defaultdict(list)
    for some in batches({order.asset_id for order in orders}):
        query = (
            select(IndexedInspection.asset, Inspection)
            .join(Inspection, Inspection.id == IndexedInspection.inspection_id)
            .where(IndexedInspection.asset.in_(some))
        )
        for asset_id, row in session.execute(query):
            inspections[str(asset_id)].append(row)
        query_of_numbers = select(WorkOrder.asset_id, WorkOrder.number)
        for asset_id, number in session.execute(
            query_of_numbers.where(WorkOrder.asset_id.in_(some))
        ):
            numbers[asset_id].append(number)
    of_order = {
        order.id: counted(
            order.number, order.ordered_at, numbers[order.asset_id], inspections[order.asset_id]
        )
        for order in orders
    }
    shown, accepted = _said(session, {one.id for one in of_order.values() if one is not None})
    differing: dict[str, tuple[State, str | None]] = {}
    for order in orders:
        one = of_order[order.id]
        own = None if one is None else one.id
        state = state_of(one, is_shown=own in shown, is_accepted=own in accepted)
        if (state, own) != (order.state, order.inspection_id):
            differing[order.id] = state, own
    return differing


def _said(session: Session, ids: Iterable[str]) -> tuple[set[str], set[str]]:
    """Return which inspections a client was shown, and which were accepted as they are."""
    shown: set[str] = set()
    answers: Mapping[str, list[AcceptanceAnswer]] = defaultdict(list)
    for some in batches(ids):
        of = AcceptanceSection.inspection_id
        shown |= set(session.scalars(select(of).where(of.in_(some))))
        said = select(AcceptanceAnswer).where(AcceptanceAnswer.inspection_id.in_(some))
        for answer in session.scalars(said.order_by(AcceptanceAnswer.at, AcceptanceAnswer.id)):
            answers[answer.inspection_id].append(answer)
    versions = versions_of(session, answers)
    accepted = {one for one, said in answers.items() if standing(said, versions[one]) == "accepted"}
    return shown, accepted
