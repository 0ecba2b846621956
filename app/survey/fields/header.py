"""The fields of an inspection's header: their names, allowed values, the places that exchange
formats have for them, and which ones a report needs.

A header may hold other names too, since surveys are imported from other programs; only the values
of the fields listed here are checked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date

from app.survey.fields.declaration import (
    AS_IT_IS,
    Column,
    Field,
    Group,
    Kind,
    Value,
    ValueList,
    at,
)
from app.survey.fields.lists import (
    ASSET_TYPES,
    CLEANED,
    DIRECTIONS,
    END_CONDITIONS,
    FLOW_CONTROL,
    LENGTH_SOURCES,
    LININGS,
    MATERIALS,
    METHODS,
    PURPOSES,
    REFERENCE_POINTS,
    SHAPES,
    WEATHER,
)

LONGEST_TEXT = 20_000
"""Longest text of a field; remarks of an imported survey hold what has no field of its own."""

_TIME = re.compile(r"([01][0-9]|2[0-3]):[0-5][0-9](:[0-5][0-9])?")
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")


@dataclass(frozen=True)
class HeaderField(Field):
    """One field of the header."""

    group: Group = "more"
    """required: a report cannot be issued without it; auto: the program can fill it in."""


def _text(group: Group, name: str, **places: str | Column) -> HeaderField:
    return HeaderField(name, "text", at(**places), group=group)


def _listed(
    group: Group, name: str, kind: Kind, values: ValueList, **places: str | Column
) -> HeaderField:
    return HeaderField(name, kind, at(**places), values, group=group)


def _number(
    group: Group, name: str, unit: str | None, least: float, most: float, **places: str | Column
) -> HeaderField:
    return HeaderField(name, "number", at(**places), None, unit, least, most, group)


def _day(group: Group, name: str, **places: str | Column) -> HeaderField:
    return HeaderField(name, "date", at(**places), group=group)


FIELDS: tuple[HeaderField, ...] = (
    _text("required", "asset_id", en="AAA", isybau="Objektbezeichnung", m150="HG001",
          wincan="OBJ_Key OBJ_Name OBJ_PK"),
    _text("required", "start_node", en="AAB"),
    _text("required", "end_node"),
    _listed("required", "direction", "choice", DIRECTIONS, en="AAK",
            isybau=Column("Inspektionsrichtung", default="O"), m150=Column("HI101", default="I"),
            wincan="INS_InspectionDir"),
    _day("required", "date", en="ABF", isybau="Inspektionsdatum", m150="HI104",
         wincan="INS_StartDate INS_TimeStamp"),
    HeaderField("time", "time", group="required", columns=at(
        en="ABG", isybau="Uhrzeit", m150="HI105", wincan="INS_StartTime")),
    _text("required", "operator", en="ABH", isybau=Column("NameUntersucher", longest=40),
          m150="HI112", wincan="INS_Inspector INS_InspectorName INS_Operator INS_Surveyor"),
    _text("required", "client", en="AAM", m150="HI001",
          wincan="INS_Customer INS_Client OBJ_Owner OBJ_Ownership"),
    _listed("required", "asset_type", "choice", ASSET_TYPES, en=Column("ACK", other="Z"),
            isybau=Column("Entwaesserungsart", default="KR"), m150=Column("HG302", default="R")),
    _listed("required", "shape", "choice", SHAPES, en="ACA", isybau="Profilart", m150="HG305",
            wincan="OBJ_Shape"),
    _number("required", "height_mm", "mm", 1, 50_000, en=Column("ACB", 0),
            isybau=Column("Profilhoehe", 0, most=9999), m150=Column("HG307", 0, most=9999),
            wincan="OBJ_PipeHeightOrDia OBJ_Size1"),
    _number("required", "width_mm", "mm", 1, 50_000, en=Column("ACC", 0),
            isybau=Column("Profilbreite", 0, most=9999), m150=Column("HG306", 0, most=9999),
            wincan="OBJ_Size2"),
    _listed("required", "material", "text", MATERIALS, en=Column("ACD", other="Z"),
            isybau="Material", m150="HG304", wincan="OBJ_Material"),
    _listed("required", "reference_point", "text", REFERENCE_POINTS,
            en=Column("ABC", default="A", other="Z"), isybau="BezugspunktLage", m150="HI102"),
    _text("required", "standard", en="ABA", m150="HI005", wincan="INS_Standard INS_CodingSystem"),
    _listed("required", "end_condition", "choice", END_CONDITIONS),
    _text("auto", "edition"),
    _text("auto", "code_pack"),
    _text("auto", "video_files", en="ABS", m150="HI116",
          wincan="INS_VideoFile INS_VideoFileName"),
    _text("auto", "rig_id"),
    _text("auto", "calibration_id"),
    _number("auto", "unit_length_m", "m", 0.001, 1000, en=Column("ACG", 3),
            isybau=Column("Regeleinzelrohrlaenge", 2, is_fixed=True, most=99.99),
            m150=Column("HG314", 3, is_fixed=True, most=999.999),
            wincan="OBJ_PipeJointLength OBJ_PipeUnitLength OBJ_PipeLength"),
    _number("auto", "camera_offset_m", "m", -1000, 1000),
    _text("auto", "abandon_reason"),
    _text("auto", "reverse_of"),
    _text("more", "upstream_node"),
    _text("more", "downstream_node"),
    _text("more", "operator_certificate"),
    _text("more", "reviewer"),
    _text("more", "contractor", isybau=Column("Auftragnehmer", longest=60), m150="HI111"),
    _text("more", "job_ref", en="ABI", isybau=Column("Auftragsbezeichnung", longest=60),
          m150="HI002", wincan="INS_JobNumber INS_WorkOrder OBJ_Project"),
    _text("more", "client_job_ref", en="ABJ", isybau=Column("Auftragsnummer", longest=40)),
    _listed("more", "purpose", "choice", PURPOSES, en=Column("ABP", other="Z"),
            isybau="Inspektionszweck", m150=Column("HI004", default="4")),
    _listed("more", "method", "choice", METHODS, en=Column("ABE", default="B"),
            isybau=Column("Inspektionsverfahren", default="0"),
            m150=Column("HI103", default="2")),
    _listed("more", "lining_type", "text", LININGS, en=Column("ACE", other="Z"), m150="HG308"),
    _listed("more", "lining_material", "text", MATERIALS, en=Column("ACF", other="Z"),
            m150=Column("HG309", other=AS_IT_IS)),
    _number("more", "known_length_m", "m", 0.001, 100_000,
            isybau=Column("Laenge", 2, is_fixed=True, most=999.99),
            m150=Column("HG310", 3, is_fixed=True, most=9999.999)),
    _listed("more", "known_length_source", "choice", LENGTH_SOURCES),
    _number("more", "expected_length_m", "m", 0.001, 100_000, en=Column("ABQ", 2),
            wincan="OBJ_RealLength OBJ_Length"),
    _number("more", "year", None, 1, 9999, en=Column("ACN", 0), isybau=Column("Baujahr", 0),
            m150=Column("HG303", 0), wincan="OBJ_ConstructionYearText OBJ_ConstructionYear"),
    _listed("more", "cleaned", "bool", CLEANED, en="ACM", isybau="Reinigung", m150="HI107"),
    _day("more", "cleaned_on"),
    _listed("more", "weather", "text", WEATHER, en="ADA", isybau="Wetter", m150="HI106",
            wincan="INS_Weather"),
    _number("more", "temperature_c", "°C", -100, 100,
            isybau=Column("Temperatur", 0, least=-99, most=99), m150=Column("HI108", 1),
            wincan="INS_Temperature"),
    _listed("more", "flow_control", "text", FLOW_CONTROL, en=Column("ADC", other="Z"),
            isybau=Column("Wasserhaltung", other="6"), m150="HI109"),
    _number("more", "water_level_pct", "%", 0, 100, m150=Column("HI110", 0)),
    _text("more", "location_text", en="AAJ", wincan="OBJ_Street"),
    _text("more", "road", en="AAJ", isybau=Column("Strassenname", longest=40), m150="HG102"),
    _text("more", "road_chainage"),
    _text("more", "road_chainage_end"),
    _number("more", "start_lat", "°", -90, 90),
    _number("more", "start_lon", "°", -180, 180),
    _number("more", "end_lat", "°", -90, 90),
    _number("more", "end_lon", "°", -180, 180),
    _text("more", "camera", m150="HI006"),
    _text("more", "lens", m150="HI006"),
    HeaderField("tether", "bool"),
    _text("more", "remarks", en="ADE", isybau="Bemerkung", m150="HI999",
          wincan="INS_Memo OBJ_Memo"),
)  # fmt: skip
"""Every known field, in the order of a form."""

ASSET_FIELDS = (
    "start_node", "end_node", "upstream_node", "downstream_node", "client", "asset_type", "shape",
    "height_mm", "width_mm", "material", "lining_type", "lining_material", "unit_length_m",
    "known_length_m", "known_length_source", "expected_length_m", "year", "location_text", "road",
    "road_chainage", "road_chainage_end",
)  # fmt: skip
"""Fields that belong to the asset and not to one survey of it: a register may hold them."""

BY_NAME = {field.name: field for field in FIELDS}
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
        if (field := BY_NAME.get(name)) is not None and not is_empty(value)
    )
    return [fault for fault in found if fault is not None]


def _is_needed(field: HeaderField, header: Mapping[str, Value]) -> bool:
    if field.name in _NEEDED_IF:
        other, values = _NEEDED_IF[field.name]
        return header.get(other) in values
    return field.group == "required"


def _fault(field: HeaderField, value: Value) -> str | None:
    match field.kind:
        case "number":
            unit = f" {field.unit}" if field.unit else ""
            wanted = f"a number (not text) from {field.minimum:g} to {field.maximum:g}{unit}"
            is_right = _is_number_within(value, field.minimum, field.maximum)
        case "choice":
            wanted, is_right = f"one of {', '.join(field.choices)}", value in field.choices
        case "date":
            wanted, is_right = "a date such as 2026-03-31", _is_date(value)
        case "time":
            wanted = "a time of day such as 14:05 or 14:05:30"
            is_right = isinstance(value, str) and _TIME.fullmatch(value) is not None
        case "bool":
            wanted, is_right = "true or false", isinstance(value, bool)
        case "text":
            wanted, is_right = "text", isinstance(value, str)
    return None if is_right else f"{field.name} must be {wanted} (found {value!r:.60})"


def _is_number_within(value: Value, minimum: float | None, maximum: float | None) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    low = -math.inf if minimum is None else minimum
    return low <= value <= (math.inf if maximum is None else maximum)


def _is_date(value: Value) -> bool:
    if not isinstance(value, str) or not _DATE.fullmatch(value):
        return False  # Python also reads 20260331 and 2026-W14-2
    try:
        date.fromisoformat(value)
    except ValueError:
        return False
    return True
