"""Files of code packs that mean harm, or are damaged: each is refused in a sentence."""

import io
import zipfile
from collections.abc import Callable

import openpyxl
import pytest

from app.errors import InvalidPack
from app.imports import workbook
from app.reports.tables.pack_template import pack_template
from app.survey.catalogue import example_pack
from app.survey.catalogue.read import MAX_BYTES, read_table
from app.survey.catalogue.table import CodeTable
from vo_core.csv_rows import plain

pytestmark = pytest.mark.unit

TEMPLATE = pack_template()
HEAD, FIRST = example_pack().decode().splitlines()[:2]


def with_part(name: str, content: bytes = b"") -> bytes:
    """The template with one more part, or with another one in its place."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(TEMPLATE)) as old, zipfile.ZipFile(out, "w", 8) as new:
        for part in old.infolist():
            if part.filename != name:
                new.writestr(part.filename, old.read(part))
        new.writestr(name, content)
    return out.getvalue()


def changed(change: Callable[[openpyxl.Workbook], object]) -> bytes:
    book = openpyxl.load_workbook(io.BytesIO(TEMPLATE))
    change(book)
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def set_cell(sheet: str, cell: str, value: object) -> Callable[[openpyxl.Workbook], object]:
    return lambda book: book[sheet].__setitem__(cell, value)


def imported(content: bytes) -> CodeTable:
    """As an import reads it, apart from the child."""
    if not content.startswith(b"PK"):
        return read_table("Harm", content)
    sheets = workbook.read(content)
    return read_table("Harm", sheets.text.encode(), sheets.place)


ENTITIES = (
    b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]><x>&b;</x>'
)
MANY_ROWS = b"<row/>" * 10**6
SHEET = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (lambda: with_part("bomb.xml", bytes(40 * 2**20)), "unpacks to more than 32 MiB"),
        (lambda: with_part("xl/worksheets/sheet1.xml",
                           SHEET + MANY_ROWS + b"</sheetData></worksheet>"),
         "sheet codes has more than 5000 rows"),
        (lambda: with_part("xl/vbaProject.bin"), "has macros. Save it as a workbook without"),
        (lambda: with_part("xl/externalLinks/externalLink1.xml"), "has links to other files"),
        (lambda: with_part("xl/embeddings/x.bin"), "has embedded files"),
        (lambda: with_part("xl/sharedStrings.xml", ENTITIES), "declares XML entities"),
        (lambda: with_part("xl/sharedStrings.xml", b"<sst"), "cannot be read as an XLSX workbook"),
        (lambda: TEMPLATE[: len(TEMPLATE) // 2], "cannot be read as an XLSX workbook"),
        (lambda: changed(set_cell("codes", "D3", "=1+1")), "codes, row 3: D3 holds a formula"),
        (lambda: changed(set_cell("ratings", "A1", "name")), "of the sheet ratings must be rating"),
        (lambda: changed(set_cell("codes", "C4", "L")), "SPL T L is already in sheet codes, row 3"),
        (lambda: changed(set_cell("ratings", "E2", "WHOLE")), "row 2: of names 'WHOLE', which is"),
        (lambda: changed(set_cell("codes", "K3", 9)), "row 3: min_q1 (9) is greater than max_q1"),
        (lambda: f"{HEAD}\n{FIRST}\n{FIRST}".encode(), "MOU is already in line 2"),
        (lambda: f"{HEAD}\n{FIRST}".encode("utf-16"), "is not in UTF-8"),
        (lambda: HEAD.encode() + b"\n\xff", "Line 2 is not in UTF-8"),
        (lambda: HEAD.encode() + b"\n" * 10**6, "more than 5000 rows"),
        (lambda: b"x" * (MAX_BYTES + 1), "bytes; a pack may have"),
        (lambda: f"{HEAD}\n{FIRST}".replace("Mou", "M\0u").encode(), "line 2: label must be"),
    ],
)  # fmt: skip
def test_a_file_that_means_harm_is_refused_in_a_sentence(
    content: Callable[[], bytes], said: str
) -> None:
    with pytest.raises(InvalidPack) as refused:
        imported(content())
    assert said in str(refused.value)
    assert len(str(refused.value)) < 4000


def test_a_text_that_looks_like_a_formula_is_a_text_in_every_table() -> None:
    table = f"{HEAD}\n{FIRST.replace('Mouth of the barrel', '=cmd|calc')}".encode()
    (code,) = read_table("Ours", table).rows
    assert (code.label, plain(code.label)) == ("=cmd|calc", "'=cmd|calc")
