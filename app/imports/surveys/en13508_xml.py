"""Reads the XML of EN 13508-2, and RIBX: a block `ZB` or `ZB_A` for a survey, `ZC` for a row."""

from __future__ import annotations

from functools import partial

from app.imports.surveys.cells import clean, number
from app.imports.surveys.en13508_fields import Coded, survey_from
from app.imports.surveys.survey import Caveat, ImportedFile, ImportedSurvey, Notes, file_of
from app.imports.surveys.xml_file import Element, first_rows, note_unread, unknown_parts
from app.survey.places import grids

_PIPES = ("ZB", "ZB_A")
_ENDS = {"AAE": "AAD", "AAG": "AAF"}
"""The place of a node, and the node."""


def looks_like(root: Element) -> bool:
    """Return whether a file has this format."""
    return root.name == "DATA" and any(block.name.startswith("ZB") for block in root.children)


def read(root: Element) -> ImportedFile:
    """Read all readable inspections of pipes in the file; the warnings say what is left out."""
    blocks = [child for child in root.children if child.name.startswith("ZB")]
    warnings = unknown_parts(root, {"ZA", *(block.name for block in blocks)})
    return file_of(((block.line, partial(_survey, block)) for block in blocks), warnings)


def _survey(block: Element, room: int) -> ImportedSurvey | Caveat:
    if block.name not in _PIPES:
        return Caveat("block_of_no_pipe", block.line, {"name": block.name[:10]})
    cells = _cells(block)
    if not any(text for _, text in cells):
        return Caveat("block_without_header", block.line)
    notes = Notes()
    explained = {
        child.name.upper(): words
        for child in block.children
        if (words := clean(child.attributes.get("ADE", "")))
    }
    places = _places(block, dict(cells), notes)
    rows = [(row.line, _cells(row)) for row in first_rows(block.all("ZC"), room, notes)]
    note_unread(notes, block)
    return survey_from(cells, rows, notes, block.line, explained=explained, places=places)


def _cells(parent: Element) -> Coded:
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
