"""Every format of one report tells the same distances, as far as its own decimals go."""

import csv
import io
import json
import re
import zipfile
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import openpyxl
import pytest
from hypothesis import given, settings
from keys import Key
from random_reports import reports
from reports import report

from app.reports.formats import FORMATS

MADE = replace(report(), signer=Key())
DISTANCES_M = [entry.distance_m for entry in MADE.entries]


def content_of(kind, made=MADE):
    return b"".join(FORMATS[kind].write(made).blocks())


def in_csv(content):
    rows = csv.DictReader(io.StringIO(content.decode("utf-8-sig")))
    return [float(row["distance_m"]) for row in rows]


def in_json(content):
    return [row["distance_m"] for row in json.loads(content)["observations"]]


def in_xlsx(content):
    head, *rows = openpyxl.load_workbook(io.BytesIO(content))["observations"].values
    return [row[head.index("distance_m")] for row in rows]


class Cells(HTMLParser):
    def __init__(self):
        super().__init__()
        self.texts = []

    def handle_data(self, data):
        self.texts.append(data)


def in_html(content):
    table = content.decode().split('<table class="observations">')[1].split("</table>")[0]
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


@pytest.mark.parametrize(
    ("kind", "read", "within_m"),
    [
        ("csv", in_csv, 1e-9),
        ("json", in_json, 1e-9),
        ("xlsx", in_xlsx, 1e-9),
        ("html", in_html, 0.005),
        ("en13508", in_en13508, 0.05),
        ("ribx", in_ribx, 0.05),
        ("isybau", in_isybau, 0.005),
    ],
)
def test_distances_are_the_same(kind, read, within_m):
    told = read(content_of(kind))
    coded = [entry.distance_m for entry in MADE.entries if entry.code]
    assert told in (
        pytest.approx(DISTANCES_M, abs=within_m + 1e-9),
        pytest.approx(coded, abs=within_m + 1e-9),  # a code is what the format is about
    )


def test_the_bundle_holds_the_very_same_files():
    with zipfile.ZipFile(io.BytesIO(content_of("zip"))) as archive:
        for kind in ("csv", "json", "xlsx", "html"):
            name = f"{FORMATS[kind].stem}{FORMATS[kind].suffix}"
            assert archive.read(name) == content_of(kind)


@settings(max_examples=10, deadline=None)
@given(made=reports())
def test_every_table_of_any_report_tells_its_distances(made):
    told = [entry.distance_m for entry in made.entries if entry.distance_m is not None]
    assert in_json(content_of("json", made))[: len(told)] == told
    assert in_xlsx(content_of("xlsx", made))[: len(told)] == told
    rows = csv.DictReader(io.StringIO(content_of("csv", made).decode("utf-8-sig"), newline=""))
    assert [float(row["distance_m"]) for row in rows if row["distance_m"]] == told
