"""Detects the format of a file by its content, and reads it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from app.errors import InvalidImport
from app.imports.moved import chainage_json
from app.imports.moved.whole_inspection import WholeInspection
from app.imports.surveys import (
    en13508_text,
    en13508_xml,
    isybau,
    m150,
    wincan,
    xml_file,
)
from app.imports.surveys.survey import ImportedFile

MIB = 2**20
_OF_XML = "EN 13508-2 XML, RIBX, ISYBAU XML, DWA-M 150 XML"


def read(content: bytes) -> ImportedFile | WholeInspection:
    """Return the content of a file; call this only in a child process with limits.

    Raises:
        InvalidImport: The format is unknown, or the file is damaged or too large; the text says why
        and where.
    """
    for looks_like, most_mib, read_it in _FORMATS:
        if not looks_like(content):
            continue
        if len(content) > most_mib * MIB:
            raise InvalidImport(
                f"The file has {len(content) / MIB:.1f} MiB; one of its kind may have {most_mib}."
            )
        return read_it(content)
    raise InvalidImport(
        "The file has none of the known formats: EN 13508-2 text (its first line begins with "
        f"#A1 or #B01), {_OF_XML}, WinCan .db3, or the JSON report of Chainage."
    )


def _xml(content: bytes) -> ImportedFile:
    root, said = xml_file.parsed(content)
    for looks_like, read_it in (
        (en13508_xml.looks_like, en13508_xml.read),
        (isybau.looks_like, isybau.read),
        (m150.looks_like, m150.read),
    ):
        if looks_like(root):
            file = read_it(root)
            return replace(file, warnings=(*said, *file.warnings))
    raise InvalidImport(
        f"The XML file begins with {root.name:.40}, which is none of the known formats: {_OF_XML}."
    )


_FORMATS: tuple[
    tuple[Callable[[bytes], bool], int, Callable[[bytes], ImportedFile | WholeInspection]], ...
] = (
    # An export of 2000 defects in a film of three hours at 30 Hz has some 60 MB, most of it track.
    (chainage_json.is_chainage_json, 64, chainage_json.read),
    # A project with as many defects has 2 MB, but may contain catalogues and small pictures too.
    (wincan.looks_like, 64, wincan.read),
    # A survey of 2000 defects has 0.5 MB, and a file of 200 surveys 6 MB.
    (en13508_text.looks_like, 16, en13508_text.read),
    # ISYBAU needs some 700 bytes for each observation: 14 MB for 20 000.
    (xml_file.looks_like, 32, _xml),
)
"""How a format is known, how many MiB a file may have, and its reader."""
