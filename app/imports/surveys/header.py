"""The header of a survey, made of the texts that a file has in its columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from app.imports.surveys.cells import figure, iso_date, number, time_of_day
from app.imports.surveys.survey import Notes
from app.survey.fields.declaration import AS_IT_IS, OTHER, Column, Family, Field, kept_name
from app.survey.fields.header import FIELDS, faults
from app.survey.fields.in_words import taken_from_remarks


def header_of(
    family: Family,
    value_of: Callable[[str], str],
    notes: Notes,
    line: int | None = None,
    explained: dict[str, str] | None = None,
) -> dict[str, Any]:
    """Return the header that a file states; a code that no list has is kept, with a warning.

    Args:
        family: Of the format.
        value_of: Returns the text of a column, or an empty one.
        notes, line: For warnings.
        explained: What letters Z stand for, by their codes; those that become values are removed.
    """  # fmt: skip
    header: dict[str, Any] = {}
    read: set[str] = set()
    for field in FIELDS:
        column = field.columns.get(family)
        if column is None or column.code in read:
            continue
        read.add(column.code)
        texts = [text for code in column.codes if (text := value_of(code))]
        if not texts:
            continue
        if field.listed(family):
            name, value = _coded(field, column, family, texts[0], explained)
            code = texts[0].upper()
            if name != field.name and code == column.default:
                continue
            if name != field.name and code != (column.other or OTHER):
                notes.add(
                    "unknown_value", line, field=field.name, value=f"{texts[0]!r:.40}", own=name
                )
            header[name] = value
        elif field.kind == "number":
            text = next((text for text in texts if number(text) is not None), texts[0])
            header[field.name] = figure(text)
        elif field.kind == "date":
            header[field.name] = iso_date(texts[0]) or texts[0]
        elif field.kind == "time":
            header[field.name] = next(filter(None, map(time_of_day, texts)), texts[0])
        else:
            header[field.name] = texts[0]
    return header


def _coded(
    field: Field, column: Column, family: Family, code: str, explained: dict[str, str] | None
) -> tuple[str, Any]:
    words = (explained or {}).get(column.code)
    if explained and words and code.upper() == OTHER and not faults({field.name: words}):
        del explained[column.code]
        return field.name, words
    value = field.values.value(family, code) if field.values else None
    if value is None and column.other == AS_IT_IS:
        return field.name, code
    if value is None:
        return kept_name(family, column.codes[0]), code
    return field.name, value


def with_words(header: Mapping[str, Any], family: Family) -> dict[str, Any]:
    """Return a header with what stands in words of its remarks, and without the codes of other
    values that these words replace.
    """
    found = taken_from_remarks(header, family)
    for field in FIELDS:
        if field.listed(family) and found.get(field.name) not in (None, "", "unknown"):
            found.pop(kept_name(family, field.columns[family].codes[0]), None)
    return found


def at_ends(
    header: Mapping[str, Any], places: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Return the fields of the places of both ends, by the names of their nodes."""
    found: dict[str, float] = {}
    for end in ("start", "end"):
        place = places.get(str(header.get(f"{end}_node")))
        if place is not None:
            found[f"{end}_lon"], found[f"{end}_lat"] = place
    return found
