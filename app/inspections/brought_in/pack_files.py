"""Files of code packs that people bring: CSV, or a workbook that a child reads."""

from __future__ import annotations

from dataclasses import dataclass

from app.errors import InvalidPack
from app.inspections.brought_in.file_reader import FileReader
from app.inspections.packs import Packs, PackView
from app.survey.catalogue.read import in_line, read_table
from app.survey.catalogue.table import CodeTable
from vo_core.csv_rows import decoded

_WORKBOOK, _OLD_WORKBOOK = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
"""How a file begins that is a ZIP, or a workbook of Excel before 2007 or with a password."""


@dataclass(frozen=True)
class PackPreview:
    """What an import would add, or all that prevents it."""

    table: CodeTable | None
    faults: tuple[str, ...]


class PackFiles:
    """Reads files of packs and adds them."""

    def __init__(self, reader: FileReader, packs: Packs) -> None:
        self._reader = reader
        self._packs = packs

    def preview(self, title: str, content: bytes) -> PackPreview:
        """Return what is in a file, which is not kept.

        Raises:
            Busy: Other files are being read.
        """
        try:
            return PackPreview(self._read(title, content)[0], ())
        except InvalidPack as refused:
            return PackPreview(None, refused.faults)

    def add(self, title: str, content: bytes, project: str | None, who: str) -> PackView:
        """Add a pack or its next version.

        Raises:
            InvalidPack: The text says what is wrong, row by row.
            PackNameTaken: The pack of this title is of another project, or has this table.
            Busy: Other files are being read.
        """
        return self._packs.add(title, self._read(title, content)[1], project, who)

    def _read(self, title: str, content: bytes) -> tuple[CodeTable, str]:
        if content.startswith(_OLD_WORKBOOK):
            raise InvalidPack(
                "The workbook is of an old kind or has a password. Save it as XLSX without one."
            )
        if content.startswith(_WORKBOOK):
            sheets = self._reader.read_workbook(content)
            return read_table(title, sheets.text.encode(), sheets.place), sheets.text
        return read_table(title, content, in_line), decoded(content, InvalidPack)
