"""The common part of ISYBAU XML and DWA-M 150: pipe, survey and rows in terms of the German
lists.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from app.reports.exchange import lists
from app.reports.exchange.coordinates import Ends, utm_m
from app.reports.exchange.fields import Fields
from app.reports.exchange.survey import (
    END,
    START,
    Names,
    Row,
    day_of,
    joined,
    length_m,
    unit_length_m,
)
from app.reports.report import Loss, Report
from app.survey.rounding import decimals

OTHER_FLOW_CONTROL = "6"
"""U107."""

_Written = TypeVar("_Written")
_MAX_MM, _MAX_STRETCH = 9999, 99


@dataclass(frozen=True)
class Lengths:
    """Limits and decimals of the lengths of a pipe and its units in a format."""

    most_m: float
    most_unit_m: float
    digits: int

    def pipe(self, value_m: float | None) -> str | None:
        """None for what the format cannot hold."""
        return self._within(value_m, self.most_m)

    def unit(self, value_m: float | None) -> str | None:
        """Format the length of a unit, likewise."""
        return self._within(value_m, self.most_unit_m)

    def _within(self, value_m: float | None, most_m: float) -> str | None:
        if value_m is None or not 0 <= value_m <= most_m:
            return None
        return decimals(value_m, self.digits)


@dataclass(frozen=True)
class Pipe:
    """The culvert; values that the header does not state in the words of the lists are None."""

    length: str | None
    unit_length: str | None
    height: str | None
    """Height in mm; the width follows in mm."""
    width: str | None
    shape: str | None
    material: str | None
    """Code of list G102."""
    year: float | None


def pipe_of(report: Report, fields: Fields, shapes: Mapping[str, str], lengths: Lengths) -> Pipe:
    """Describe the culvert of a report.

    Args:
        report: Its report.
        fields: The header of the report.
        shapes: The list of the format.
        lengths: What the format can hold.
    """
    height = fields.rounded("height_mm", 0, 0, _MAX_MM)
    width = fields.rounded("width_mm", 0, 0, _MAX_MM)
    shape = fields.choice("shape", shapes)
    if width is None and shape == shapes["circular"]:
        width = height
    words = fields.text("material")
    material = lists.material(words) if words else None
    if not (material and material.german):
        fields.leave("material")
    length = lengths.pipe(length_m(report, fields, lengths.most_m))
    unit_length = lengths.unit(unit_length_m(report, fields, lengths.most_unit_m))
    year = fields.number_within("year", 1, 9999)
    for name, digits in (
        ("known_length_m", lengths.digits),
        ("unit_length_m", lengths.digits),
        ("year", 0),
    ):
        fields.note_digits(name, digits)
    return Pipe(
        length=length,
        unit_length=unit_length,
        height=height,
        width=width,
        shape=shape,
        material=material.german if material else None,
        year=year,
    )


@dataclass(frozen=True)
class Survey:
    """Time, method and weather of the survey; None as in `Pipe`."""

    day: str | None
    clock: str | None
    direction: str
    zero: str | None
    """U105."""
    weather: str | None
    """U106."""
    flow_control: str | None
    """U107."""
    is_cleaned: bool | None


def survey_of(
    report: Report, fields: Fields, directions: Mapping[str, str]
) -> tuple[Survey, list[Loss]]:
    """Describe the survey of a report, and what had to be assumed.

    Args:
        report: Its report.
        fields: The header of the report; what the lists do not know is left to the remark.
        directions: The list of the format.
    """
    day, losses = day_of(report, fields)
    direction = fields.choice("direction", directions)
    if direction is None:
        direction = directions["with_flow"]
        losses.append(Loss("no_direction"))
    clock = fields.time()
    assumed = "" if report.source.kind == "import" else "inner face"
    zero = lists.reference_point(fields.text("reference_point") or assumed)
    weather = lists.weather(fields.text("weather"))
    control = fields.text("flow_control")
    number = lists.flow_control(control) if control else None
    for name, is_known in (
        ("reference_point", zero),
        ("weather", weather),
        ("flow_control", number),
        ("asset_type", lists.is_distinct(report.header.get("asset_type"))),
    ):
        if not is_known:
            fields.leave(name)
    survey = Survey(
        day=day,
        clock=":".join(clock) if clock else None,
        direction=direction,
        zero=zero.german if zero else None,
        weather=weather.german if weather else None,
        flow_control=number or (OTHER_FLOW_CONTROL if control else None),
        is_cleaned=fields.flag("cleaned"),
    )
    return survey, losses


def or_kept(
    report: Report, fields: Fields, name: str, own: str, written: _Written
) -> _Written | str:
    """Return what is written for a header field, or the value that an import kept instead.

    Args:
        report: The report.
        fields: Its header.
        name: The header field, of a list of the format.
        own: The header field that keeps a value outside the list.
        written: Stands for the field otherwise.
    """
    if report.header.get(name) in (None, "", "unknown"):
        return fields.text(own) or written
    return written


def points_of(ends: Ends | None, names: Names) -> dict[str, tuple[float, float]]:
    """Return easting and northing of the nodes, the upstream one first; empty if unknown."""
    points = utm_m(ends) if ends else None
    if points is None:
        return {}
    of_name = {names.end: points[1], names.start: points[0]}
    return {name: of_name[name] for name in (names.upstream, names.downstream)}


def fitted(row: Row) -> tuple[Row, list[Loss]]:
    """Fit a row to both formats.

    A start or an end is characterised as XP there, and stretches have two figures; the remark has
    what that leaves out.
    """
    losses = []
    if row.code in (START, END):
        row = replace(row, remark=joined(row.remark, _characters(row)), char1="XP", char2="")
    if row.stretch and row.stretch[1] > _MAX_STRETCH:
        letter, number = row.stretch
        row = replace(row, remark=joined(row.remark, f"stretch {letter}{number}"), stretch=None)
        losses.append(Loss("stretch_number", row.entry, most=_MAX_STRETCH))
    return row, losses


def _characters(row: Row) -> str:
    """Name the character of a start or an end; empty if it is XP."""
    chars = f"{row.char1}{row.char2}"
    return "" if chars in ("", "XP") else f"coded {row.code} {row.char1} {row.char2}".rstrip()
