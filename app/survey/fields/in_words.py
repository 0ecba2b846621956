"""Header fields as words of a remark, for formats that have no place for them, and back."""

from __future__ import annotations

import re
from collections.abc import Mapping

from app.survey.fields.declaration import AS_IT_IS, Family, Value
from app.survey.fields.header import FIELDS, HeaderField, faults, number_of

TECHNICAL = frozenset(
    {
        "code_pack", "rig_id", "calibration_id", "camera_offset_m", "reverse_of", "camera", "lens",
        "tether", "start_lat", "start_lon", "end_lat", "end_lon",
    }
)  # fmt: skip
"""Fields that no reader of a remark needs."""
_NEVER_WORDS = TECHNICAL | {"standard", "end_condition", "abandon_reason", "remarks"}
_BETWEEN = ", "
_PLACE = {field.name: place for place, field in enumerate(FIELDS)}


def in_words(field: HeaderField, value: object) -> str:
    """Return a value with its label and unit, such as `water level: 17 %`, on one line.

    The unit is in ASCII, which some files are as a whole.
    """
    unit = (field.unit or "").replace("°", "deg")
    return " ".join(f"{_label(field)}: {_text(value)} {unit}".split())


def taken_from_remarks(header: Mapping[str, Value], family: Family) -> dict[str, Value]:
    """Return a header with the fields that stand at the end of its remarks, as `in_words`.

    Writers add them in the order of the fields, so the run ends where that order does. Behind the
    last one that the file states otherwise they leave the remarks; writing the header adds them
    again, at the same place.

    Args:
        header: Values that the file states; they stay, but for those of a rough column.
        family: Of the format of the file.
    """
    items = str(header.get("remarks") or "").split(_BETWEEN)
    found: dict[str, Value] = {}
    kept, last = len(items), len(FIELDS)
    are_leaving = True
    for place in reversed(range(len(items))):
        read = _read(items[place])
        if read is None or _is_held(read[0], family) or _PLACE[read[0].name] >= last:
            break
        field, value = read
        last = _PLACE[field.name]
        if header.get(field.name, value) != value and not _is_rough(field, family):
            are_leaving = False
            continue
        found[field.name] = value
        kept = place if are_leaving else kept
    return {**header, **found, "remarks": _BETWEEN.join(items[:kept])} if found else dict(header)


def _is_held(field: HeaderField, family: Family) -> bool:
    """Return whether a format always holds a field, so that no writer states it in words."""
    column = field.columns.get(family)
    if column is None or field.name == "video_files":
        return False
    return not field.listed(family) or field.kind == "bool" or column.other == AS_IT_IS


def _is_rough(field: HeaderField, family: Family) -> bool:
    """Return whether a format states some values of a choice by the code of another one."""
    values, column = field.listed(family), field.columns.get(family)
    if values is None or column is None or not column.default or field.kind != "choice":
        return False
    return any(
        values.value(family, values.code(family, choice)) != choice for choice in field.choices
    )


def _label(field: HeaderField) -> str:
    return re.sub(r"_(m|mm|pct|c)$", "", field.name).replace("_", " ")


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


_FIELD_OF = {_label(field): field for field in FIELDS if field.name not in _NEVER_WORDS}


def _read(item: str) -> tuple[HeaderField, Value] | None:
    """Return what an item states, if writing it again gives the same item."""
    label, separator, text = item.partition(": ")
    field = _FIELD_OF.get(label)
    if field is None or not separator:
        return None
    item = item.replace(" °C", " degC")  # of earlier versions
    value: Value = text
    if field.kind == "number":
        value = number_of(text.partition(" ")[0])
    elif field.kind == "bool":
        value = {"yes": True, "no": False}.get(text)
    if value is None or faults({field.name: value}) or in_words(field, value) != item:
        return None
    return field, value
