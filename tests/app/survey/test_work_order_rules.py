"""Work orders: tables as offices write them, and which inspection counts for an order."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, date, datetime, timedelta

import pytest

from app.errors import InvalidTable
from app.survey.assets.order_table import read_orders
from app.survey.assets.work_orders import Order, counted, state_of

pytestmark = pytest.mark.unit

NOW = datetime(2026, 9, 14, tzinfo=UTC)
GERMAN = (
    "Auftragsnummer;Haltung;Grund;Fällig am;Projekt;Bemerkung\r\nA-1;H 7;Rückstau;31.12.2026;P;\r\n"
)


@dataclass
class Inspected:
    id: str = "one"
    status: str = "done"
    review_state: str = "draft"
    created_at: datetime = NOW
    header: dict[str, object] = field(default_factory=dict)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16"])
def test_a_german_table_is_read_in_every_encoding(encoding: str) -> None:
    table = read_orders(GERMAN.encode(encoding))
    assert not table.faults
    expected = Order(
        number="A-1", asset_id="H 7", reason="Rückstau", due_on=date(2026, 12, 31), project="P"
    )
    assert table.stated == [(2, expected)]


def test_each_fault_is_named_with_its_line_and_the_other_rows_are_read() -> None:
    rows = (
        "order,asset,due,reason", "A,1,2026-02-30,", ",2,,", "A,,,", "A,3,,a,b",
        "A,4,1/2/2027,=1+1", "A,4,,", f"A,5,,{'x' * 2001}",
    )  # fmt: skip
    table = read_orders("\n".join(rows).encode())
    found = [(fault.row, fault.reason) for fault in table.faults]
    assert found == [
        (2, "date"), (3, "number"), (4, "id"), (5, "cells"), (7, "twice"), (8, "long"),
    ]  # fmt: skip
    ((line, order),) = table.stated
    assert (line, order.reason, order.due_on) == (6, "=1+1", date(2027, 2, 1))


def test_a_person_states_what_the_columns_hold() -> None:
    table = read_orders(b"x,y\n1,2\n", ["asset_id", "number"])
    assert [(order.number, order.asset_id) for _, order in table.stated] == [("2", "1")]
    for wrong in (["asset_id"], ["asset_id", "wkt"], ["number", "number"]):
        with pytest.raises(InvalidTable):
            read_orders(b"x,y\n1,2\n", wrong)


def test_a_table_of_thousands_of_lines_is_read_and_an_endless_one_refused() -> None:
    lines = "\n".join(f"A,{n},why" for n in range(5000))
    assert len(read_orders(f"order,asset,reason\n{lines}".encode()).stated) == 5000
    with pytest.raises(InvalidTable, match="50000"):
        read_orders(b"order,asset\n" + b"A,1\n" * 50_001)


def test_the_newest_inspection_since_the_order_counts_unless_it_names_another_order() -> None:
    before = Inspected("before", created_at=NOW - timedelta(days=1))
    first, second = Inspected("first"), Inspected("second", created_at=NOW + timedelta(days=1))
    of_other = Inspected("other", created_at=NOW + timedelta(days=2))
    of_other.header = {"client_job_ref": "B"}
    every = [before, of_other, second, first]
    assert counted("A", NOW, ["A", "B"], every) is second
    assert counted("A", NOW, ["A"], every) is of_other  # B is no order of this asset
    assert counted("A", NOW, ["A", "B"], [before]) is None


@pytest.mark.parametrize(
    ("inspected", "is_shown", "is_accepted", "expected"),
    [
        (None, False, False, "ordered"),
        (Inspected(status="running"), True, False, "in_progress"),
        (Inspected(status="failed"), False, False, "in_progress"),
        (Inspected(status="cancelled"), False, False, "inspected"),
        (Inspected(review_state="approved"), False, False, "delivered"),
        (Inspected(), True, False, "delivered"),
        (Inspected(), True, True, "accepted"),
    ],
)
def test_the_state_is_that_of_the_inspection(inspected, is_shown, is_accepted, expected) -> None:
    assert state_of(inspected, is_shown=is_shown, is_accepted=is_accepted) == expected
