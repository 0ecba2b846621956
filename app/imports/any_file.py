"""Detects the format of a file by its content, and reads it."""

from __future__ import annotations

from dataclasses import replace

from app.errors import InvalidImport
from app.imports import (
    chainage_json,
    en13508_text,
    en13508_xml,
    isybau,
    m150,
    wincan,
    xml_file,
)
from app.imports.survey import ImportedFile
from app.imports.whole_inspection import WholeInspection

MIB = 2**20
_MOST_TEXT_BYTES = 16 * MIB
"""A survey of 2000 defects has 0.5 MB of EN 13508-2 text, and a file of 200 surveys 6 MB."""
_MOST_XML_BYTES = 32 * MIB
"""ISYBAU needs some 700 bytes for each observation: 14 MB for 20 000."""
_OF_XML = "EN 13508-2 XML, RIBX, ISYBAU XML, DWA-M 150 XML"
_MOST_JSON_BYTES = _MOST_DATABASE_BYTES = 64 * MIB
"""An export of 2000 defects in a film of three hours at 30 Hz has some 60 MB, most of it track. A
WinCan project with as many defects has 2 MB, but may contain catalogues and small pictures too."""


def read(content: bytes) -> ImportedFile | WholeInspection:
    """Return the content of a file; call this only in a child process with limits.

    Raises:
        InvalidImport: The format is unknown, or the file is damaged or too large; the text says why
        and where.
    """
    if chainage_json.is_chainage_json(content):
        _require_size(content, _MOST_JSON_BYTES)
        return chainage_json.read(content)
    if wincan.looks_like(content):
        _require_size(content, _MOST_DATABASE_BYTES)
        return wincan.read(content)
    if en13508_text.looks_like(content):
        _require_size(content, _MOST_TEXT_BYTES)
        return en13508_text.read(content)
    if xml_file.looks_like(content):
        _require_size(content, _MOST_XML_BYTES)
        return _xml(content)
    raise InvalidImport(
        "The file has none of the known formats: EN 13508-2 text (its first line begins with "
        f"#A1 or #B01), {_OF_XML}, WinCan .db3, or the JSON report of Chainage."
    )


def _xml(content: bytes) -> ImportedFile:
    root, said = xml_file.parsed(content)
    if en13508_xml.looks_like(root):
        file = en13508_xml.read(root)
    elif isybau.looks_like(root):
        file = isybau.read(root)
    elif m150.looks_like(root):
        file = m150.read(root)
    else:
        raise InvalidImport(
            f"The XML file begins with {root.name:.40}, which is none of the known formats: "
            f"{_OF_XML}."
        )
    return replace(file, warnings=(*said, *file.warnings))


def _require_size(content: bytes, most: int) -> None:
    if len(content) > most:
        raise InvalidImport(
            f"The file has {len(content) / MIB:.1f} MiB; one of its kind may have {most // MIB}."
        )
