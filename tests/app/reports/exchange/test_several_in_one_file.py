"""One exchange file with several inspections, as a delivery has it at its top."""

from dataclasses import replace

import pytest
from brought_in import reported
from exchange_readers import (
    read_en13508,
    read_en13508_xml,
    read_isybau,
    read_m150,
    read_ribx,
)
from reports import HEADER, OBSERVATIONS, report

from app.imports import any_file
from app.reports.formats import EXCHANGE, FORMATS

READERS = {
    "en13508": read_en13508, "en13508xml": read_en13508_xml, "ribx": read_ribx,
    "isybau": read_isybau, "m150": read_m150,
}  # fmt: skip
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
        source = replace(base.source, sha256=f"{number:064x}")
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
    same = [replace(made, source=surveys[0].source, film=surveys[0].film) for made in surveys]
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
