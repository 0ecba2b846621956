"""Work orders of an office: taken up as a table or one by one, and followed until they end."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.storage.records.work_orders import Orders as Orders
from app.storage.records.work_orders import OrderView as OrderView
from app.storage.records.work_orders import WorkOrderStore
from app.survey.assets.order_table import Fault, Named, read_orders
from app.survey.assets.register import Asset
from app.survey.assets.work_orders import End, Order, State, Step
from app.tracking.worker import Worker

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0
_LOOK_EVERY_S = 30.0
"""Longest time until a change is noticed that no index has announced, such as a deletion."""
_LEAST_PAUSE_S = 0.3
"""Between two looks at all open orders: 5,000 of them take 0.05 s."""


@dataclass(frozen=True)
class OrderImport:
    """What a table of orders does."""

    columns: Sequence[Named]
    steps: Sequence[Step]
    faults: Sequence[Fault]


class WorkOrders:
    """Keeps the orders."""

    def __init__(self, store: WorkOrderStore, tell: Callable[[], None]) -> None:
        """Call `tell` whenever a message to the client may wait."""
        self._store = store
        self._tell = tell

    def preview(self, content: bytes, columns: Sequence[str], *, adds_assets: bool) -> OrderImport:
        """Return what the import of a table would do; nothing changes.

        Args:
            content: The file.
            columns: What its columns hold; by default it is guessed.
            adds_assets: Whether assets that the register lacks are added to it.
        Raises:
            InvalidTable: The content is no table, or the columns are not those of the table.
        """
        table = read_orders(content, columns)
        steps, faults = self._store.planned(table.stated, adds_assets=adds_assets)
        return OrderImport(table.columns, steps, _by_line([*table.faults, *faults]))

    def take(
        self, content: bytes, columns: Sequence[str], who: str, *, adds_assets: bool
    ) -> OrderImport:
        """Import the rows of a table that have no fault.

        Raises:
            InvalidTable: As `preview`; nothing is stored.
        """
        table = read_orders(content, columns)
        steps, faults = self._store.take(table.stated, who, adds_assets=adds_assets)
        logger.info("%s imported a table of %d work orders.", who, len(steps))
        self._tell()
        return OrderImport(table.columns, steps, _by_line([*table.faults, *faults]))

    def add(
        self, order: Order, asset: Asset | None, who: str, key: str | None, body: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Add an order; return its fields as they were when it was added, which the same request
        under the same key returns again.

        Raises:
            IdempotencyKeyReused: Another request was answered under the key.
            WorkOrderExists: The number has this asset already.
            AssetNotFound: The register does not have the asset, and no data of it are given.
        """
        return self._store.add(order, asset, who, key, body)

    def get(self, order_id: str) -> OrderView:
        """Return an order.

        Raises:
            WorkOrderNotFound: No order has this id.
        """
        return self._store.get(order_id)

    def listed(self, state: State | None, number: str | None, since: int, limit: int) -> Orders:
        """Return the orders that changed after a cursor, the earliest change first."""
        return self._store.listed(state, number, since, limit)

    def end(self, order_id: str, end: End, who: str) -> OrderView:
        """Close or cancel an order; one that has ended so stays as it is.

        Raises:
            WorkOrderNotFound: No order has this id.
            WorkOrderEnded: It has ended otherwise.
        """
        view = self._store.end(order_id, end, who)
        logger.info("%s: work order %s is %s.", who, order_id, end)
        self._tell()
        return view

    def follow(self) -> None:
        """Derive the states of all open orders from the inspections as they are indexed."""
        if self._store.follow():
            self._tell()


class OrderFollower(Worker):
    """A thread that follows the inspections with the states of the orders."""

    def __init__(self, orders: WorkOrders) -> None:
        super().__init__("work-orders", stop_timeout_s=_STOP_TIMEOUT_S)
        self._orders = orders

    def _step(self) -> float:
        self._orders.follow()
        self._pause(_LEAST_PAUSE_S)
        return _LOOK_EVERY_S


def _by_line(faults: Sequence[Fault]) -> list[Fault]:
    return sorted(faults, key=lambda fault: fault.row)
