"""The fields of an inspection's header: their names, allowed values and which ones a report needs.

A header may hold other names too, since surveys are imported from other programs; only the values
of the fields listed here are checked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from typing import Literal

Group = Literal["required", "auto", "more"]
Kind = Literal["text", "number", "choice", "date", "time", "bool"]
Value = str | int | float | bool | None
LONGEST_TEXT = 20_000
"""Longest text of a field; remarks of an imported survey hold what has no field of its own."""

_TIME = re.compile(r"([01][0-9]|2[0-3]):[0-5][0-9](:[0-5][0-9])?")
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")


@dataclass(frozen=True)
class HeaderField:
    """One field of the header."""

    name: str
    group: Group
    """required: a report cannot be issued without it; auto: the program can fill it in."""
    kind: Kind
    choices: tuple[str, ...] = ()
    """Allowed values of a choice."""
    unit: str | None = None
    """Unit of a number: mm, m, %, °C or °."""
    minimum: float | None = None
    """Smallest allowed number; `maximum` is the largest."""
    maximum: float | None = None


def _numbers(
    group: Group, unit: str | None, minimum: float, maximum: float, *names: str
) -> tuple[HeaderField, ...]:
    return tuple(
        HeaderField(name, group, "number", unit=unit, minimum=minimum, maximum=maximum)
        for name in names
    )


def _texts(group: Group, *names: str) -> tuple[HeaderField, ...]:
    return tuple(HeaderField(name, group, "text") for name in names)


FIELDS: tuple[HeaderField, ...] = (
    *_texts("required", "asset_id", "start_node", "end_node"),
    HeaderField("direction", "required", "choice", ("with_flow", "against_flow", "unknown")),
    HeaderField("date", "required", "date"),
    HeaderField("time", "required", "time"),
    *_texts("required", "operator", "client"),
    HeaderField(
        "asset_type", "required", "choice", ("culvert", "storm", "foul", "combined", "drain")
    ),
    HeaderField(
        "shape",
        "required",
        "choice",
        ("circular", "rectangular", "egg", "arch", "u_shaped", "oval", "other"),
    ),
    *_numbers("required", "mm", 1, 50_000, "height_mm", "width_mm"),
    *_texts("required", "material", "reference_point", "standard"),
    HeaderField("end_condition", "required", "choice", ("complete", "abandoned")),
    *_texts("auto", "edition", "code_pack", "video_files", "rig_id", "calibration_id"),
    *_numbers("auto", "m", 0.001, 1000, "unit_length_m"),
    *_numbers("auto", "m", -1000, 1000, "camera_offset_m"),
    *_texts("auto", "abandon_reason", "reverse_of"),
    *_texts("more", "upstream_node", "downstream_node"),
    *_texts("more", "operator_certificate", "reviewer", "contractor", "job_ref", "client_job_ref"),
    HeaderField(
        "purpose",
        "more",
        "choice",
        (
            "first_survey", "routine", "acceptance", "end_of_warranty", "follow_up",
            "before_repair", "after_repair",
        ),
    ),
    HeaderField("method", "more", "choice", ("camera", "walk_through", "from_end_only")),
    *_texts("more", "lining_type", "lining_material"),
    *_numbers("more", "m", 0.001, 100_000, "known_length_m"),
    HeaderField("known_length_source", "more", "choice", ("drawing", "tape", "survey")),
    *_numbers("more", "m", 0.001, 100_000, "expected_length_m"),
    *_numbers("more", None, 1, 9999, "year"),
    HeaderField("cleaned", "more", "bool"),
    HeaderField("cleaned_on", "more", "date"),
    *_texts("more", "weather"),
    *_numbers("more", "°C", -100, 100, "temperature_c"),
    *_texts("more", "flow_control"),
    *_numbers("more", "%", 0, 100, "water_level_pct"),
    *_texts("more", "location_text", "road", "road_chainage", "road_chainage_end"),
    *_numbers("more", "°", -90, 90, "start_lat"),
    *_numbers("more", "°", -180, 180, "start_lon"),
    *_numbers("more", "°", -90, 90, "end_lat"),
    *_numbers("more", "°", -180, 180, "end_lon"),
    *_texts("more", "camera", "lens"),
    HeaderField("tether", "more", "bool"),
    *_texts("more", "remarks"),
)  # fmt: skip
"""Every known field, in the order of a form."""

ASSET_FIELDS = (
    "start_node", "end_node", "upstream_node", "downstream_node", "client", "asset_type", "shape",
    "height_mm", "width_mm", "material", "lining_type", "lining_material", "unit_length_m",
    "known_length_m", "known_length_source", "expected_length_m", "year", "location_text", "road",
    "road_chainage", "road_chainage_end",
)  # fmt: skip
"""Fields that belong to the asset and not to one survey of it: a register may hold them."""

_BY_NAME = {field.name: field for field in FIELDS}
_NEEDED_IF: Mapping[str, tuple[str, tuple[Value, ...]]] = {
    # field: it is required when another field has one of these values
    "width_mm": ("shape", ("rectangular", "egg", "arch", "u_shaped", "oval", "other")),
    "abandon_reason": ("end_condition", ("abandoned",)),
}


def required_to_issue(header: Mapping[str, Value]) -> list[str]:
    """Return the names of empty fields that a report needs, in the order of the form.

    The width is needed unless the shape is circular, a reason only where the survey was abandoned.
    """
    return [
        field.name
        for field in FIELDS
        if _is_needed(field, header) and is_empty(header.get(field.name))
    ]


def number_of(value: object) -> float | None:
    """Return a finite number, also from text, as imported headers hold; else None."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def project_of(header: Mapping[str, object]) -> str | None:
    """Return the project that an inspection belongs to: as stated, else its job; else None."""
    return _first_text(header, "project", "job_ref", "client_job_ref")


def asset_of(header: Mapping[str, object]) -> str | None:
    """Return the name of what was inspected; None if it is not stated."""
    return _first_text(header, "asset_id")


def _first_text(header: Mapping[str, object], *names: str) -> str | None:
    found = (str(value).strip() for name in names if (value := header.get(name)) is not None)
    return next((text for text in found if text), None)


def is_empty(value: Value) -> bool:
    """Return whether a value is missing or blank text; zero and false are answers."""
    return value is None or (isinstance(value, str) and not value.strip())


def faults(header: Mapping[str, Value]) -> list[str]:
    """Describe what is wrong with the values of known fields, one sentence each; empty values
    pass.
    """
    found = (
        _fault(field, value)
        for name, value in header.items()
        if (field := _BY_NAME.get(name)) is not None and not is_empty(value)
    )
    return [fault for fault in found if fault is not None]


def _is_needed(field: HeaderField, header: Mapping[str, Value]) -> bool:
    if field.name in _NEEDED_IF:
        other, values = _NEEDED_IF[field.name]
        return header.get(other) in values
    return field.group == "required"


def _fault(field: HeaderField, value: Value) -> str | None:
    if _fits(field, value):
        return None
    return f"{field.name} must be {_wanted(field)} (found {value!r:.60})"


def _wanted(field: HeaderField) -> str:
    match field.kind:
        case "number":
            unit = f" {field.unit}" if field.unit else ""
            return f"a number (not text) from {field.minimum:g} to {field.maximum:g}{unit}"
        case "choice":
            return f"one of {', '.join(field.choices)}"
        case "date":
            return "a date such as 2026-03-31"
        case "time":
            return "a time of day such as 14:05 or 14:05:30"
        case "bool":
            return "true or false"
        case "text":
            return "text"


def _fits(field: HeaderField, value: Value) -> bool:
    match field.kind:
        case "number":
            return _is_number_within(value, field.minimum, field.maximum)
        case "choice":
            return value in field.choices
        case "date":
            return isinstance(value, str) and _is_date(value)
        case "time":
            return isinstance(value, str) and _TIME.fullmatch(value) is not None
        case "bool":
            return isinstance(value, bool)
        case "text":
            return isinstance(value, str)


def _is_number_within(value: Value, minimum: float | None, maximum: float | None) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    low = -math.inf if minimum is None else minimum
    return low <= value <= (math.inf if maximum is None else maximum)


def _is_date(text: str) -> bool:
    if not _DATE.fullmatch(text):
        return False  # Python also reads 20260331 and 2026-W14-2
    try:
        date.fromisoformat(text)
    except ValueError:
        return False
    return True
