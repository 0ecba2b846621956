"""Reads the XML of EN 13508-2, and RIBX: a block `ZB` or `ZB_A` for a survey, `ZC` for a row."""

from __future__ import annotations

from app.imports.en13508_fields import Coded, header_of, observations_of, with_film_of
from app.imports.survey import (
    MOST_OBSERVATIONS,
    MOST_OF_FILE,
    MOST_SURVEYS,
    Caveat,
    ImportedFile,
    ImportedSurvey,
    Notes,
    clean,
    number,
    survey_of,
    too_many_surveys,
)
from app.imports.xml_file import Element, note_unread, unknown_parts
from app.survey import grids

_PIPES = ("ZB", "ZB_A")
_ENDS = {"AAE": "AAD", "AAG": "AAF"}
"""The place of a node, and the node."""


def looks_like(root: Element) -> bool:
    """Return whether a file has this format."""
    return root.name == "DATA" and any(block.name.startswith("ZB") for block in root.children)


def read(root: Element) -> ImportedFile:
    """Read all readable inspections of pipes in the file; the warnings say what is left out."""
    surveys: list[ImportedSurvey] = []
    blocks = {child.name for child in root.children if child.name.startswith("ZB")}
    warnings = unknown_parts(root, {"ZA", *blocks})
    room = MOST_OF_FILE
    for block in root.children:
        if not block.name.startswith("ZB"):
            continue
        if len(surveys) == MOST_SURVEYS:
            warnings.append(too_many_surveys(block.line))
            break
        if block.name not in _PIPES:
            warnings.append(Caveat("block_of_no_pipe", block.line, {"name": block.name[:10]}))
        elif not any(text for _, text in _cells(block)):
            warnings.append(Caveat("block_without_header", block.line))
        else:
            surveys.append(_survey(block, min(room, MOST_OBSERVATIONS)))
            room -= len(surveys[-1].observations)
    return ImportedFile(tuple(surveys), tuple(warnings))


def _survey(block: Element, room: int) -> ImportedSurvey:
    notes = Notes()
    cells = _cells(block)
    explained = {
        child.name.upper(): words
        for child in block.children
        if (words := clean(child.attributes.get("ADE", "")))
    }
    header = header_of(cells, notes, explained)
    header |= _places(block, dict(cells), notes)
    children = [child for child in block.children if child.name == "ZC"]
    if len(children) > room:
        notes.add_too_many(children[room].line)
    rows = [(row.line, _cells(row)) for row in children[:room]]
    header = with_film_of(rows, header)
    observations = observations_of(rows, header, notes)
    note_unread(notes, block)
    return survey_of(header, observations, notes, f"Inspection of line {block.line}")


def _cells(parent: Element) -> Coded:
    """Return the texts of the children without children."""
    return [
        (child.name.upper(), clean(child.own_text(), len(child.text)))
        for child in parent.children
        if not child.children
    ]


def _places(block: Element, stated: dict[str, str], notes: Notes) -> dict[str, float]:
    """Return the ends in degrees, from the Dutch grid."""
    found: dict[str, float] = {}
    for code, node in _ENDS.items():
        position = block.value(code, "Point", "pos")
        if not position:
            continue
        x_m, y_m = (*(number(part, 1e7) for part in position.split()), None, None)[:2]
        place = None if x_m is None or y_m is None else grids.degrees(grids.DUTCH, x_m, y_m)
        if place is None:
            notes.add("not_dutch", block.line, code=code, text=f"{position!r:.40}")
            continue
        is_start = stated.get(node) == stated.get("AAB", stated.get("AAD"))
        end = "start" if is_start else "end"
        found[f"{end}_lon"], found[f"{end}_lat"] = place
    return found
