"""Every format of one report states the same distances, within its own decimals."""

import contextlib
import csv
import io
import json
import re
import zipfile
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import openpyxl
import pypdfium2
import pytest
from hypothesis import given
from hypothesis import strategies as st
from keys import Key
from random_reports import reports
from reports import report

from app.errors import ExportNotAvailable
from app.reports.formats import FORMATS
from app.reports.report import Photo
from app.survey.rounding import decimals, metres

MADE = replace(report(), signer=Key())


def content_of(kind, made=MADE):
    return b"".join(FORMATS[kind].write(made).blocks())


class Cells(HTMLParser):
    def __init__(self):
        super().__init__()
        self.texts = []

    def handle_data(self, data):
        self.texts.append(data)


def in_html(content):
    table = content.decode().split('<table class="cards observations">')[1].split("</table>")[0]
    parser = Cells()
    parser.feed(table)
    found = (re.fullmatch(r"(-?[0-9.]+) ± [0-9.]+ m", text) for text in parser.texts)
    return [float(match[1]) for match in found if match]


def in_en13508(content):
    lines = content.decode("ascii").splitlines()
    start = next(n for n, line in enumerate(lines) if line.startswith("#C="))
    names = lines[start].removeprefix("#C=").split(";")
    rows = csv.reader(lines[start + 1 : -1], delimiter=";")
    return [float(row[names.index("I")]) for row in rows]


def in_ribx(content):
    return [float(found.text) for found in ElementTree.fromstring(content).iter("I")]  # noqa: S314  (ours)


def in_isybau(content):
    name = "{http://www.bfr-abwasser.de}Station"
    return [float(found.text) for found in ElementTree.fromstring(content).iter(name)]  # noqa: S314


HALVES_M = {3.815: "3.82", 2.675: "2.68", 1.005: "1.01", 0.125: "0.13", 10.295: "10.30"}
"""Halves of a centimetre, whose binary forms lie above or below, and what people make of them."""


def halved(**changes):
    """A report of such distances whose intervals must not be rounded down."""
    observations = [
        {"distance_m": m, "u95_m": 0.011, "code": "BAB", "char1": "B", "char2": "A"}
        for m in sorted(HALVES_M)
    ]
    return replace(report(None, observations), **changes)


def in_m150(content):
    return [float(text) for text in re.findall(r"station ([0-9.]+) m", content.decode("latin-1"))]


def in_pdf(content):
    with pypdfium2.PdfDocument(content) as pdf:
        text = " ".join(page.get_textpage().get_text_bounded() for page in pdf)
    return sorted({float(found) for found in re.findall(r"([0-9.]+)(?: m)? ± 0.02 m", text)})


@pytest.mark.parametrize(
    ("kind", "read"),
    [
        ("pdf", in_pdf), ("html", in_html), ("isybau", in_isybau), ("en13508", in_en13508),
        ("ribx", in_ribx), ("m150", in_m150),
    ],
)  # fmt: skip
def test_a_half_is_rounded_away_from_zero_in_every_format(kind, read):
    shown = [float(HALVES_M[m]) for m in sorted(HALVES_M)]
    assert read(content_of(kind, halved())) == shown


@pytest.mark.parametrize("kind", ["pdf", "html", "isybau", "en13508", "ribx", "m150"])
def test_an_interval_is_rounded_up_in_every_format(kind):
    content = content_of(kind, halved())
    if kind == "pdf":
        with pypdfium2.PdfDocument(content) as pdf:
            text = " ".join(page.get_textpage().get_text_bounded() for page in pdf)
    else:
        text = content.decode("latin-1" if kind == "m150" else "utf-8")
    assert re.search(r"(±|\+/-) ?0\.02 m", text)
    assert not re.search(r"(±|\+/-) ?0\.0[01] m", text.split("measurement")[0])


@given(
    mm=st.integers(-(10**7), 10**7), digits=st.sampled_from([1, 2]), below_mm=st.floats(-0.04, 0.04)
)
def test_every_rounding_is_that_of_the_decimal_figure(mm, digits, below_mm):
    """Long division by hand, in whole millimetres."""
    step = 10 ** (3 - digits)
    whole = (abs(mm) + step // 2) // step
    sign = "-" if mm < 0 and whole else ""
    shown = f"{sign}{whole // 10**digits}.{whole % 10**digits:0{digits}d}"
    assert decimals(metres(mm + below_mm), digits) == shown


def test_the_bundle_holds_the_very_same_files():
    with zipfile.ZipFile(io.BytesIO(content_of("zip"))) as archive:
        for kind in ("csv", "json", "xlsx", "html"):
            name = f"{FORMATS[kind].stem}{FORMATS[kind].suffix}"
            assert archive.read(name) == content_of(kind)


def tables_of(made):
    """What each table says of a row, by the name of its photo."""
    table = csv.DictReader(io.StringIO(content_of("csv", made).decode("utf-8-sig"), newline=""))
    sheet = openpyxl.load_workbook(io.BytesIO(content_of("xlsx", made)))["observations"].values
    head = next(sheet)
    found = {"csv": list(table), "xlsx": [dict(zip(head, row, strict=True)) for row in sheet]}
    with contextlib.suppress(ExportNotAvailable):
        features = json.loads(content_of("geojson", made))["features"]
        points = [it["properties"] for it in features if it["id"].startswith("obs-")]
        found["geojson"] = points
    return {kind: {row["photo_file"]: row for row in rows} for kind, rows in found.items()}


def number(value):
    return None if value in (None, "") else float(value)


@given(made=reports())
def test_every_table_of_any_report_agrees_row_by_row(made):
    """To the millimetre; exchange files have tests of their own."""
    named = tuple(
        replace(entry, photo=Photo(f"p-{entry.seq:03d}.jpg", None, None)) for entry in made.entries
    )
    made = replace(made, entries=named)
    reported = {
        row["photo_file"]: row for row in json.loads(content_of("json", made))["observations"]
    }
    assert [row["distance_m"] for row in reported.values()] == [it.distance_m for it in named]
    exact = ("quant1", "quant2", "clock_from", "clock_to", "severity", "cont_id")
    within = dict.fromkeys(
        ("distance_m", "distance_u95_m", "distance_raw_m", "video_time_s"), 0.0005
    ) | dict.fromkeys(exact, 1e-9)
    for kind, rows in tables_of(made).items():
        assert list(rows) == list(reported), kind
        for name, row in rows.items():
            for field, step in within.items():
                found = number(row.get(field))
                assert found == pytest.approx(reported[name][field], abs=step), (kind, field)
            assert (row.get("code") or None) == reported[name]["code"]
