"""The header of a report as a format writes it, column by column of `app.survey.fields`.

A field that was written is not said in words behind the remark, and is no loss; what neither a
column nor words can hold is a loss. So losses follow from the table of columns.
"""

from __future__ import annotations

from app.reports.report import Loss, Phrase, Report
from app.reports.text.ascii import one_line
from app.survey.fields.declaration import AS_IT_IS, Column, Family, Field, ValueList, kept_name
from app.survey.fields.header import BY_NAME, FIELDS, faults, is_empty, number_of
from app.survey.fields.in_words import TECHNICAL, in_words
from app.survey.rounding import decimals

_NEVER_SAID = frozenset({"standard", "end_condition", "abandon_reason"})
"""Fields that other sentences and the rows cover."""
_WRITTEN_APART = frozenset({"asset_id", "start_node", "standard", "video_files", "remarks"})
"""Fields that a file needs in a form of its own."""


class Header:
    """The header of a report while a file is written."""

    def __init__(self, report: Report, family: Family, format_name: str) -> None:
        self._stated = report.header
        self._family: Family = family
        self._format = format_name
        self._assumed = _assumed_of(report)
        self._written = set(_NEVER_SAID)
        self._rounded: list[Phrase] = []
        self._losses: list[Loss] = []

    def columns(self, **assumed: object) -> dict[str, str]:
        """Return the filled columns of the format by their codes, without names, film and remarks.

        Args:
            assumed: Values for fields that are not stated.
        """
        self._assumed |= assumed
        found: dict[str, str] = {}
        for field in FIELDS:
            column = field.columns.get(self._family)
            if column is None or field.name in _WRITTEN_APART:
                continue
            if text := self._text_of(field, column):
                found[column.code] = ", ".join(filter(None, (found.get(column.code), text)))
        return found

    def text(self, name: str) -> str:
        """Return a text on one line, which is written by that; empty if there is none."""
        value = self._stated.get(name)
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            return ""
        found = one_line(str(value))
        if found:
            self._written.add(name)
        return found

    def number(self, name: str) -> float | None:
        """Return a number within the bounds of its field, which is written by that, or None."""
        field = BY_NAME[name]
        found = _within(number_of(self._stated.get(name)), field.minimum, field.maximum)
        if found is not None:
            self._written.add(name)
        return found

    def note_written(self, *names: str) -> None:
        """Mark fields as written in another way."""
        self._written.update(names)

    def leave(self, name: str) -> None:
        """Mark a field that was read as not written after all."""
        self._written.discard(name)

    def words(self) -> list[str]:
        """Return stated fields that were not written, for a remark; they then count as written.

        Call it last, after all other fields.
        """
        said = []
        for field in FIELDS:
            value = self._stated.get(field.name)
            if field.name in self._written or field.name in TECHNICAL or is_empty(value):
                continue
            self._written.add(field.name)
            said.append(one_line(in_words(field, value)))
        return said

    def cut(self, text: str, longest: int | None, what: Phrase) -> str:
        """Return as much of a text as the format can hold, and note what is lost."""
        if longest is None or len(text) <= longest:
            return text
        self._losses.append(Loss("cut", format=self._format, most=longest, what=what))
        return text[:longest].rstrip()

    def losses(self) -> list[Loss]:
        """Return what was assumed, cut or rounded, and the fields that have no place."""
        found = list(self._losses)
        standard = self.text("standard")
        if standard and "13508" not in standard:
            found.append(Loss("other_standard", standard=standard))
        if self._rounded:
            found.append(Loss("rounded_fields", format=self._format, fields=tuple(self._rounded)))
        left = sorted(
            str(name)
            for name, value in self._stated.items()
            if name not in self._written and value is not None and value != ""
        )
        if left:
            named = tuple(field_name(name) for name in left)
            found.append(Loss("no_place", format=self._format, fields=named))
        return found

    def _text_of(self, field: Field, column: Column) -> str:
        if (values := field.listed(self._family)) is not None:
            return self._code(field, column, values)
        match field.kind:
            case "number":
                return self._figure(field, column)
            case "date" | "time":
                return self._moment(field.name)
            case _:
                text = self.text(field.name) or one_line(str(self._assumed.get(field.name) or ""))
                return self.cut(text, column.longest, field_name(field.name))

    def _code(self, field: Field, column: Column, values: ValueList) -> str:
        """Return the code of a value. One that an import kept, as no list has it, stands until the
        field is filled.
        """
        value = self._stated.get(field.name)
        if value in (None, "", "unknown") and (
            kept := self.text(kept_name(self._family, column.code))
        ):
            return kept
        is_bool = isinstance(value, bool)
        if is_bool != (field.kind == "bool") or value is None or not one_line(str(value)):
            assumed = self._assumed.get(field.name)
            code = values.code(self._family, assumed) if assumed else ""
        else:
            code = values.code(self._family, value)
            if code and (field.kind == "text" or values.value(self._family, code) == value):
                self._written.add(field.name)
            if not code and column.other == AS_IT_IS:
                return self.text(field.name)
            code = code or column.other
        if not code and field.name == "direction" and column.default:
            self._losses.append(Loss("no_direction"))
        return code or column.default

    def _figure(self, field: Field, column: Column) -> str:
        least = field.minimum if column.least is None else column.least
        most = field.maximum if column.most is None else column.most
        stated = _within(number_of(self._stated.get(field.name)), least, most)
        value = stated
        if value is None:
            value = _within(number_of(self._assumed.get(field.name)), 0, most)
        if value is None:
            return ""
        written = decimals(value, column.digits or 0)
        if stated is not None:
            self._written.add(field.name)
        if stated is not None and float(written) != stated:
            phrase = Phrase(
                "part.rounded_field", field=field_name(field.name), stated=stated, written=written
            )
            self._rounded.append(phrase)
        return written if column.is_fixed else plain_number(value, column.digits or 0)

    def _moment(self, name: str) -> str:
        value = self._stated.get(name)
        if not isinstance(value, str) or is_empty(value) or faults({name: value}):
            assumed = str(self._assumed.get(name) or "")
            if assumed:
                self._losses.append(Loss("no_date", day=assumed))
            return assumed
        self._written.add(name)
        return f"{value}:00" if name == "time" and value.count(":") == 1 else value


def _assumed_of(report: Report) -> dict[str, object]:
    segment_mm = report.rig.pipe.segment_length_mm
    assumed: dict[str, object] = {
        "known_length_m": report.distance_m,
        "unit_length_m": segment_mm / 1000 if segment_mm else None,
    }
    if report.header.get("shape") == "circular":
        assumed["width_mm"] = report.header.get("height_mm")
    if report.source.kind != "import":
        assumed["date"] = report.created_at.date().isoformat()
        assumed["reference_point"] = "inner face of the headwall"
    return assumed


def _within(value: float | None, least: float | None, most: float | None) -> float | None:
    if value is None or (least is not None and value < least):
        return None
    return None if most is not None and value > most else value


def field_name(name: str) -> Phrase:
    """Return the name of a header field in the language of the report."""
    return Phrase(f"field.{name}", otherwise=one_line(name))


def plain_number(value: float, digits: int = 6) -> str:
    """Format a number without trailing zeros."""
    text = decimals(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text else text
