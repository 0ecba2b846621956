"""One exchange file with several inspections, as a delivery has it at its top."""

import io
import re
import zipfile
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from brought_in import reported
from exchange_files import READERS, each_of_the_standard
from exchange_readers import split
from keys import Key
from reports import HEADER, OBSERVATIONS, film_source, report

from app.imports import any_file
from app.reports.bundle.delivery import Delivery
from app.reports.formats import EXCHANGE, FORMATS
from app.reports.report import Extras
from app.reports.template import ReportTemplate
from app.storage.blobs.blobs import StoredBlob
from app.storage.blobs.folder import FolderBlobs

READERS = {**READERS, "isybau2024": READERS["isybau"]}
FILM = "CUL-0041_20260914_0942.mp4"
NAMELESS = {name: value for name, value in HEADER.items() if not name.endswith("_node")}

each = pytest.mark.parametrize("kind", EXCHANGE)


@pytest.fixture(scope="module")
def surveys(tmp_path_factory):
    """One culvert twice, with films and photos of one name, and two without named ends."""
    folder = tmp_path_factory.mktemp("several")
    made = []
    for number, changes in enumerate(
        (
            {"client": 'Roads; and "quotes"'},
            {"date": "2026-10-01", "job_ref": "JOB-99", "year": 1987},
            {"asset_id": "CUL-0050"},
            {"asset_id": "CUL-0051"},
        )
    ):
        own = folder / str(number)
        own.mkdir()
        (own / "film").write_bytes(b"film %d" % number)
        base = report(own, observations=OBSERVATIONS[: 12 - number])
        header = (NAMELESS if number > 1 else HEADER) | changes | {"project": "Ring road"}
        source = film_source(base.source, own / "film")
        film = StoredBlob(FolderBlobs(own), "film")
        short = ReportTemplate(sections=["observations"])  # of the reports beside the exchange file
        made.append(replace(base, header=header, source=source, film=film, template=short))
    return made


def delivered(surveys, **extras):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        delivery = Delivery(archive, datetime(2026, 11, 1, tzinfo=UTC), Key(), FORMATS)
        for number, made in enumerate(surveys, 1):
            made = replace(made, extras=Extras(**extras))
            delivery.add(made, f"{number:03d}-{made.asset}/", number)
        delivery.close()
    return zipfile.ZipFile(out)


@pytest.fixture(scope="module")
def deliveries(surveys):
    """The delivery of all in each format."""
    return {kind: delivered(surveys, exchange=kind, film=True) for kind in EXCHANGE}


def exchange_of(archive, kind):
    return archive.read(f"Ring_road{FORMATS[kind].suffix}")


@each_of_the_standard
def test_every_inspection_is_in_it_as_in_a_file_of_its_own(surveys, deliveries, kind):
    parts = split(kind, exchange_of(deliveries[kind], kind))
    found = [READERS[kind](part) for part in parts]
    own = [READERS[kind](FORMATS[kind].write(made).content) for made in surveys]
    assert [len(read.rows) for read in found] == [12, 11, 10, 9]
    told_apart = {"M", "N"} if kind == "ribx" else {"M"}
    for read, alone in zip(found, own, strict=True):
        for row, same in zip(read.rows, alone.rows, strict=True):
            for name in (row.keys() | same.keys()) - told_apart:
                if same.get(name) not in ("START", "END"):
                    assert row.get(name) == same.get(name), name


@each
def test_the_import_gives_all_of_them_back_with_equal_rows(surveys, deliveries, kind):
    found = any_file.read(exchange_of(deliveries[kind], kind)).surveys
    assert [survey.header["asset_id"] for survey in found] == [made.asset for made in surveys]
    same = (
        "distance_m", "code", "char1", "char2", "quant1", "quant2", "clock_from", "clock_to",
        "stretch", "at_joint", "remark", "severity", "time_s",
    )  # fmt: skip
    away = ("video_files", "start_node", "end_node", "remarks", "year")
    for survey, made in zip(found, surveys, strict=True):
        (alone,) = any_file.read(FORMATS[kind].write(made).content).surveys
        for name in same:
            assert [getattr(row, name) for row in survey.observations] == [
                getattr(row, name) for row in alone.observations
            ], name
        assert {k: v for k, v in survey.header.items() if k not in away} == {
            k: v for k, v in alone.header.items() if k not in away
        }
    nodes = [survey.header[end] for survey in found[2:] for end in ("start_node", "end_node")]
    assert len(set(nodes)) == 4, "nobody named these ends: they are four places"


@each
def test_every_cited_name_is_unique_and_lies_at_the_top(surveys, deliveries, kind):
    archive = deliveries[kind]
    content = exchange_of(archive, kind).decode("iso-8859-1")
    cited = re.findall(r"[^;|\s\"<>]+\.(?:jpg|mp4)", content)
    names = archive.namelist()
    assert len({name.casefold() for name in names}) == len(names)
    assert set(cited) <= set(names)
    photos = [name for name in cited if name.endswith(".jpg")]
    assert len(photos) == len(set(photos)) == 12 + 11 + 10 + 9
    for number, made in enumerate(surveys, 1):
        before = "" if number == 1 else f"{number:03d}-"
        before += f"{made.asset}-" if number > 2 else ""
        assert archive.read(before + FILM) == b"film %d" % (number - 1)
    beside = {name for name in names if "/" in name}
    assert {name.rpartition("/")[2].split("-", 2)[2] for name in beside} == {
        "report.pdf", "report.html",
    }  # fmt: skip
    page = archive.read("002-CUL-0041/CUL-0041-report.html").decode()
    assert f"../002-{FILM}#t=" in page


def test_one_film_of_two_inspections_lies_there_once(surveys):
    same = [replace(made, source=surveys[0].source, film=surveys[0].film) for made in surveys[:2]]
    archive = delivered(same, exchange="isybau", film=True)
    assert [name for name in archive.namelist() if name.endswith(".mp4")] == [FILM]


def test_what_a_file_describes_once_is_among_the_losses_where_it_differs(surveys):
    file = FORMATS["isybau"].survey_file()
    for made in surveys[:2]:
        losses = file.add(made)
    assert [loss.values["name"] for loss in losses if loss.key == "written_once"] == ["CUL-0041"]
    again = file.add(surveys[1])
    (differing,) = [loss for loss in again if loss.key == "written_once"]
    assert differing.values["name"] == "CUL-0041"


@each
def test_a_delivery_comes_back_as_a_file_with_the_same_rows(surveys, kind):
    """Import, then export of each alone: as the export of the inspection that was delivered."""
    content = exchange_of(delivered(surveys[:1], exchange=kind), kind)
    (survey,) = any_file.read(content).surveys
    back = FORMATS[kind].write(reported(surveys[0], survey)).content
    assert READERS[kind](back).rows == READERS[kind](content).rows
