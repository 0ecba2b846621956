"""What ISYBAU XML and DWA-M 150 have in common."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from app.reports.exchange.rows import END, START, Row, joined
from app.reports.report import Loss

_MAX_STRETCH = 99


def fit_rows(rows: list[Row], format_name: str, most_m: float, losses: list[Loss]) -> Iterator[Row]:
    """Yield the rows that both formats can hold, fit_rows to them; add to the losses what is left.

    A start or an end is characterised as XP there, and stretches have two figures; the remark has
    what that leaves out.
    """
    for row in rows:
        if row.distance_m > most_m:
            losses.append(Loss("too_far", row.entry, format=format_name, most=most_m))
            continue
        held = row
        if row.code in (START, END):
            own = " ".join(filter(None, ("coded", row.code, row.char1, row.char2)))
            is_said = f"{row.char1}{row.char2}" not in ("", "XP")
            held = replace(
                held, remark=joined(row.remark, own if is_said else ""), char1="XP", char2=""
            )
        if row.stretch and row.stretch[1] > _MAX_STRETCH:
            letter, number = row.stretch
            held = replace(
                held, remark=joined(held.remark, f"stretch {letter}{number}"), stretch=None
            )
            losses.append(Loss("stretch_number", row.entry, most=_MAX_STRETCH))
        yield held
