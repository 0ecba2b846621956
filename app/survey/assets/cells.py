"""Cells of a table of assets as their owners write them: numbers in any unit, years in dates."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from app.survey.fields.declaration import Value
from app.survey.fields.header import ASSET_FIELDS, BY_NAME
from app.survey.fields.values import InvalidValue, value_of

UNITS_MM: Mapping[str, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
"""Units of a length, in mm."""
DIAMETER = "diameter_mm"
"""Column of the height of a circular pipe."""
KEY = "asset_id"
ENDS = ("start_lat", "start_lon", "end_lat", "end_lon")
PLACE = (*ENDS, "wkt")
MEANINGS = (KEY, "project", DIAMETER, *ASSET_FIELDS, *PLACE)
"""What a column may hold."""
SHOWN = 60
"""Characters that a message shows of what it found."""

_DECIMALS = 4
"""A tenth of a millimetre in metres, in which `plain` lengths are stored."""
_UNIT = r"mm|cm|m|in|inch|inches|zoll|ft|feet|foot|[\"″”]|''|['′]"
_NUMBER = re.compile(
    rf"(?:DN|NW|ID|[Øø⌀])?\.?\s*([-+]?[0-9](?:[0-9.,\s]*[0-9])?)\s*({_UNIT})?\.?", re.I
)
_SAME_UNIT = {
    "inch": "in", "inches": "in", "zoll": "in", '"': "in", "″": "in", "”": "in", "''": "in",
    "feet": "ft", "foot": "ft", "'": "ft", "′": "ft",
}  # fmt: skip
_YEAR = re.compile(r"(?<![0-9])(1[5-9][0-9]{2}|20[0-9]{2})(?![0-9])")


@dataclass(frozen=True, slots=True)
class Column:
    """What a column of a table holds."""

    field: str
    """One of `MEANINGS`."""
    unit: str | None = None
    """Unit of a length, of `UNITS_MM`; None of what is no length."""

    @classmethod
    def of(cls, field: str, unit: str | None = None) -> Column:
        """Return a column; a length without a unit is in that of its field."""
        return cls(field, unit or own_unit(field))


def own_unit(field: str) -> str | None:
    """Return the unit in which a length is stored, None for what is no length."""
    known = BY_NAME.get("height_mm" if field == DIAMETER else field)
    return known.unit if known is not None and known.unit in UNITS_MM else None


def unit_named(text: str) -> str | None:
    """Return the unit that a text names, None if it is none."""
    name = text.strip().rstrip(".").lower()
    return name if name in UNITS_MM else _SAME_UNIT.get(name)


def value_in(column: Column, text: str, *, has_decimal_commas: bool) -> Value:
    """Return what a cell states, in the unit of its field; None of an empty one.

    A unit in the cell counts before that of the column; `DN 300` and `Ø 300` are numbers.

    Raises:
        InvalidValue: The text does not fit the field.
    """
    if not text:
        return None
    field = "height_mm" if column.field == DIAMETER else column.field
    if column.unit is not None:
        text = _length(column, field, text, has_decimal_commas=has_decimal_commas)
    elif field == "year" and len(years := set(_YEAR.findall(text))) == 1:
        (text,) = years  # "1998", or of a day such as 31.05.1998
    return value_of(field, text)


def _length(column: Column, field: str, text: str, *, has_decimal_commas: bool) -> str:
    """Return the number of a length in the unit of its field; the text where there is none."""
    found = _NUMBER.fullmatch(text)
    if found is None:
        return text
    number = decimal(field, "".join(found[1].split()), has_decimal_commas=has_decimal_commas)
    unit = (found[2] and unit_named(found[2])) or column.unit
    try:
        mm = float(number) * UNITS_MM[str(unit)]
    except ValueError:
        return text
    return str(round(mm / UNITS_MM[str(own_unit(field))], _DECIMALS))


def decimal(name: str, text: str, *, has_decimal_commas: bool) -> str:
    """Return the text of a number with a decimal point, whatever its country.

    Where both signs stand, the first one separates thousands.

    Raises:
        InvalidValue: It has a comma that may separate thousands, as commas separate the cells.
    """
    if "," not in text:
        return text
    if not has_decimal_commas and re.fullmatch(r"[^.,]*,[0-9]{3}", text):
        raise InvalidValue(
            f"{name} has a comma ({text[:SHOWN]!r}); write a decimal point and no separator "
            "of thousands, or separate the columns by semicolons"
        )
    if text.rfind(",") < text.rfind("."):
        return text.replace(",", "")
    return text.replace(".", "").replace(",", ".")
