"""Classes of single defects for the stability of a pipe: 1 is slight, 5 calls for action at once.

The thresholds are facts of BFR Abwasser, annex A-3 (classes of single defects, aim "stability"),
which the German federal government publishes at bfr-abwasser.de. A row is here only if two of three
public sources state it alike: the officially rated ISYBAU sample data, and the annex as two public
programs apply it. They disagree about cracks that gape, broken walls whose pieces only moved and
damaged surfaces, so those have no row. DWA-M 149-3 itself is licensed; nothing here is taken from
it.
"""

from __future__ import annotations

from dataclasses import dataclass

from app.reports.report import Entry
from app.survey.fields.lists import MATERIALS

_FLEXIBLE = ("AL", "AM", "AN", "AO", "AP", "AV", "AW", "AX")
"""Materials of EN 13508-2, list ACD, that deform before they break: metals and plastics."""


@dataclass(frozen=True)
class Threshold:
    """The classes of one kind of defect."""

    code: str
    char1: str
    """Letters that it is for; empty: any, also none. The same holds for `char2`."""
    char2: str
    classes: tuple[int, ...]
    """The class of each range of the quantity, one more than there are limits."""
    limits: tuple[float, ...] = ()
    """Where the next range begins, in `unit`."""
    unit: str | None = None
    least: float = 0.0
    """Smaller quantities have no class."""
    is_flexible_only: bool = False
    """Whether it is for pipes of metal or plastic only."""

    def concerns(self, entry: Entry) -> bool:
        """Return whether the row is for the code of an entry."""
        tag = entry.tag
        return tag.code == self.code and all(
            not letters or letter in tuple(letters)
            for letters, letter in ((self.char1, tag.char1), (self.char2, tag.char2))
        )


THRESHOLDS = (
    Threshold("BAA", "AB", "", (1, 2, 3, 4, 5), (2, 6, 10, 15), "%", is_flexible_only=True),
    Threshold("BAB", "B", "ACDE", (2, 3, 4, 5), (2, 5, 10), "mm", least=0.5),
    Threshold("BAC", "B", "", (3,)),
    Threshold("BAC", "C", "", (5,)),
    Threshold("BAD", "A", "", (3,)),
    Threshold("BAD", "CD", "", (5,)),
    Threshold("BAE", "", "", (1, 2, 3, 4), (20, 50, 100), "mm"),
    Threshold("BAJ", "ABC", "", (1,)),
    Threshold("BAK", "D", "C", (3,)),
    Threshold("BAK", "EFLZ", "", (2,)),
    Threshold("BAM", "AC", "", (2,)),
    Threshold("BAM", "B", "", (1,)),
    Threshold("BAN", "", "", (3,)),
    Threshold("BAO", "", "", (4,)),
    Threshold("BAP", "", "", (5,)),
    Threshold("BBD", "ABCDZ", "", (5,)),
    Threshold("BBF", "AB", "", (2,)),
    Threshold("BBF", "C", "", (3,)),
    Threshold("BBF", "D", "", (4,)),
    Threshold("BBG", "", "", (2,)),
)


@dataclass(frozen=True)
class Classed:
    """The class of one defect."""

    value: int | None
    """None where it has no class."""
    range: str = ""
    """The range of the quantity with its unit, such as `5-10 mm`; empty: any quantity."""
    reason: str | None = None
    """Why it has no class: no_rule, no_quantity or no_material."""


def is_flexible(words: object) -> bool | None:
    """Return whether a pipe of this material deforms before it breaks; None if it is unknown."""
    if not isinstance(words, str) or MATERIALS.meaning_of(words) is None:
        return None
    return MATERIALS.code("en", words) in _FLEXIBLE


def classed(entry: Entry, is_flexible: bool | None) -> Classed:
    """Return the class of an entry in a pipe that is flexible, rigid, or of unknown material."""
    row = next((row for row in THRESHOLDS if row.concerns(entry)), None)
    if row is None or (row.is_flexible_only and is_flexible is False):
        return Classed(None, reason="no_rule")
    if row.is_flexible_only and is_flexible is None:
        return Classed(None, reason="no_material")
    if not row.limits:
        return Classed(row.classes[0])
    size = entry.tag.quant1
    if size is None or entry.unit1 != row.unit:
        return Classed(None, reason="no_quantity")
    if size < row.least:
        return Classed(None, reason="no_rule")
    number = sum(size >= limit for limit in row.limits)
    return Classed(row.classes[number], _range(row, number))


def _range(row: Threshold, number: int) -> str:
    bounds = (row.least, *row.limits)
    low = bounds[number]
    if number == len(row.limits):
        return f"≥ {low:g} {row.unit}"
    high = f"{row.limits[number]:g} {row.unit}"
    return f"{low:g}–{high}" if low else f"< {high}"
