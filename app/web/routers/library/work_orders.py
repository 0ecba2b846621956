"""Work orders: an office states which assets are to be inspected, and follows how far each is."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Header, Path, Query
from pydantic import Field

from app import errors
from app.inspections.work_orders import WorkOrders
from app.survey.assets.register_table import MOST_COLUMNS
from app.survey.assets.work_orders import State
from app.survey.given import LINE
from app.web.deps import PrincipalDep, Service, of_projects, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.work_orders import (
    EndIn,
    OrderImportOut,
    WorkOrderIn,
    WorkOrderOut,
    WorkOrdersOut,
)
from app.web.slow import heavy

router = APIRouter(prefix="/api/work-orders", tags=["work"])

OrderId = Annotated[str, Path(pattern=r"^[0-9a-f]{32}$")]
Key = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        description="Chosen by the sender: the same request under the same key gets the same "
        "answer, for 90 days. Keys are of one token.",
    ),
]


@router.post(
    "",
    status_code=201,
    responses=failures(errors.AssetNotFound, errors.WorkOrderExists, errors.IdempotencyKeyReused),
)
@operator
@of_projects
def add(
    body: WorkOrderIn, orders: Service[WorkOrders], principal: PrincipalDep, key: Key = None
) -> WorkOrderOut:
    """Order the inspection of one asset."""
    sent: dict[str, Any] = body.model_dump(mode="json")
    answer = orders.add(body.to_order(), body.to_asset(), principal.name, key, sent)
    return WorkOrderOut.model_validate(answer)


@router.post("/import", responses=failures(errors.InvalidTable))
@operator
@heavy
def import_table(
    content: Annotated[
        bytes, Body(media_type="text/csv", description="The table, in UTF-8 or Windows-1252.")
    ],
    orders: Service[WorkOrders],
    principal: PrincipalDep,
    dry_run: Annotated[bool, Query(description="Only say what it would do.")] = False,
    add_assets: Annotated[
        bool,
        Query(description="Add assets that the register lacks, under the project of their row."),
    ] = False,
    columns: Annotated[
        list[Annotated[str, Field(max_length=40, pattern=LINE)]],
        Query(
            max_length=MOST_COLUMNS,
            description="What each column holds, in order; without any it is guessed by names.",
        ),
    ] = [],  # noqa: B006
) -> OrderImportOut:
    """Add and change the orders of a table, a row for each asset; rows with a fault are left out
    and named.
    """
    if dry_run:
        return OrderImportOut.of(orders.preview(content, columns, adds_assets=add_assets))
    found = orders.take(content, columns, principal.name, adds_assets=add_assets)
    return OrderImportOut.of(found)


@router.get("")
@viewer
@of_projects
def listed(
    orders: Service[WorkOrders],
    state: State | None = None,
    number: Annotated[str | None, Query(max_length=100, pattern=LINE)] = None,
    since: Annotated[
        int, Query(ge=0, le=2**53 - 1, description="Only what changed after this cursor.")
    ] = 0,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> WorkOrdersOut:
    """Return orders, the earliest change first; `cursor` continues after them."""
    return WorkOrdersOut.of(orders.listed(state, number, since, limit))


@router.get("/{work_order_id}", responses=failures(errors.WorkOrderNotFound))
@viewer
@of_projects
def get(work_order_id: OrderId, orders: Service[WorkOrders]) -> WorkOrderOut:
    """Return an order."""
    return WorkOrderOut.of(orders.get(work_order_id))


@router.put(
    "/{work_order_id}/state", responses=failures(errors.WorkOrderNotFound, errors.WorkOrderEnded)
)
@operator
@of_projects
def end(
    work_order_id: OrderId, body: EndIn, orders: Service[WorkOrders], principal: PrincipalDep
) -> WorkOrderOut:
    """Close or cancel an order; its other states are derived. May be repeated."""
    return WorkOrderOut.of(orders.end(work_order_id, body.state, principal.name))
