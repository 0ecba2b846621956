"""The code to start from when a proposal becomes an observation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from app.survey.catalogue.table import Code, CodeTable
from app.survey.findings.records import Direction, Proposal
from app.survey.places.clock_hours import ALL_ROUND, hour_bits

_CODES: Mapping[tuple[str, str | None], tuple[str, str | None, str | None]] = {
    # kind and direction, or where it lies: code and characters; what a picture cannot tell is open
    ("crack", "along"): ("BAB", "B", "A"),
    ("crack", "across"): ("BAB", "B", "B"),
    ("crack", "oblique"): ("BAB", "B", "D"),
    ("joint_open", None): ("BAJ", "A", None),
    ("joint_displaced", None): ("BAJ", "B", None),
    ("hole", None): ("BAC", "B", None),
    ("spall", None): ("BAF", "B", "E"),
    ("deposit", None): ("BBB", None, None),
    ("deposit", "invert"): ("BBC", None, None),
    ("roots", None): ("BBA", None, None),
    ("water", None): ("BBF", "C", None),
    ("stain", None): ("BBF", "A", None),
}
"""By the built-in codes (EN 13508-2); what a code pack says of a kind goes before."""

Named = Callable[[str | None, str | None, str | None], Code | None]

_WIDTH_IS_FIRST = ("crack", "joint_open")
"""Kinds whose first quantity is their width in mm."""
_INVERT_HOURS = hour_bits(5, 7)


@dataclass(frozen=True)
class Sector:
    """Where a finding is around a pipe, in whole hours."""

    clock_from: int
    clock_to: int | None
    """None where one hour holds it."""

    @property
    def is_invert(self) -> bool:
        """Whether all of it is at the invert."""
        return not hour_bits(self.clock_from, self.clock_to) & ALL_ROUND & ~_INVERT_HOURS


def suggested(
    found: Proposal,
    width_mm: float | None,
    sector: Sector | None,
    table: CodeTable,
    named: Named,
) -> dict[str, Any]:
    """Return the fields of a tag to start from, only those that are known.

    Args:
        found: The proposal.
        width_mm: Its width, corrected.
        sector: Where it is around the pipe; None on a floor.
        table: The codes of the inspection.
        named: Returns the row of a code, as its `named`.
    """
    fields: dict[str, Any] = coded(found, sector, table, named)
    row = named(fields.get("code"), fields.get("char1"), fields.get("char2"))
    if row is not None and row.unit_q1 == "mm" and found.kind in _WIDTH_IS_FIRST and width_mm:
        fields["quant1"] = round(width_mm, 1)
    if sector is not None and (row is None or row.needs_clock != "no"):
        fields |= {"clock_from": sector.clock_from, "clock_to": sector.clock_to}
    return {name: value for name, value in fields.items() if value is not None}


def coded(found: Proposal, sector: Sector | None, table: CodeTable, named: Named) -> dict[str, Any]:
    """Return code and characters of a kind; none where the pack of the inspection lacks them."""
    if found.code is not None:
        code = tuple(found.code.get(name) for name in ("code", "char1", "char2"))
    else:
        where: Direction | str | None = found.direction
        if found.kind == "deposit" and sector is not None and sector.is_invert:
            where = "invert"
        own = table.of_finding(found.kind, where)
        known = _CODES.get((found.kind, where)) or _CODES.get((found.kind, None))
        code = tuple(part or None for part in own.key) if own else known or (None, None, None)
    if named(*code) is None:
        return {}
    return dict(zip(("code", "char1", "char2"), code, strict=True))
