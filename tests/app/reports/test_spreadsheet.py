"""The workbook, read back with openpyxl, which shares no code with its writer."""

import io
import zipfile
from datetime import timedelta

import openpyxl
import pytest
from hypothesis import given
from random_reports import reports
from reports import AT, OBSERVATIONS, report, said, track_of

from app.reports.tables.spreadsheet import write
from app.reports.tables.table import COLUMNS, DICTIONARY, rows
from app.survey.adjustment.adjust import adjust
from app.survey.distances.corrected import Corrected
from app.survey.distances.interval import half_width_m
from app.survey.distances.stated import Joints, Mark, Stated
from app.survey.observations.records import Event
from vo_core import Rig


def book_of(made):
    return openpyxl.load_workbook(io.BytesIO(write(made).content))


def data_of(book):
    """The sheets for programs, behind those for people."""
    return book.worksheets[2:]


def records(sheet):
    head, *body = sheet.iter_rows(values_only=True)
    return [dict(zip(head, row, strict=True)) for row in body]


def test_every_cell_of_the_observations_is_what_it_was():
    made = report()
    sheet = book_of(made)["observations"]
    assert [cell.value for cell in sheet[1]] == list(COLUMNS)
    for read, found in zip(records(sheet), rows(made), strict=True):
        for name in COLUMNS:
            assert read[name] == found[name], name
    assert [record["distance_m"] for record in records(sheet)] == [
        fields["distance_m"] for fields in OBSERVATIONS
    ]


def test_no_cell_is_a_formula_and_text_stays_text_when_it_is_edited():
    made = report(observations=[{"distance_m": -1.0, "remark": t} for t in ("=1+1", "-2", "@x")])
    sheet = book_of(made)["observations"]
    cells = [row[COLUMNS.index("remark")] for row in sheet.iter_rows(min_row=2)]
    assert [(cell.value, cell.data_type) for cell in cells] == [
        ("=1+1", "s"), ("-2", "s"), ("@x", "s"),
    ]  # fmt: skip
    assert all(cell.quotePrefix for cell in cells)
    assert sheet.cell(2, COLUMNS.index("distance_m") + 1).data_type == "n"


def test_heads_are_frozen_nothing_is_merged_and_columns_can_be_read():
    for sheet in data_of(book_of(report())):
        assert sheet.freeze_panes == "A2"
        assert not sheet.merged_cells.ranges
        assert sheet.sheet_properties.pageSetUpPr.fitToPage
        assert sheet.page_setup.fitToHeight == 0  # one page wide, as many high as it takes
    sheet = book_of(report())["observations"]
    widths = {cell.value: sheet.column_dimensions[cell.column_letter].width for cell in sheet[1]}
    assert widths["report_id"] >= 32
    assert widths["seq"] >= 8
    assert max(widths.values()) <= 61


def test_the_header_states_field_value_and_unit():
    made = report(header={"height_mm": 900, "cleaned": True, "of_another": "=x", "edition": None})
    found = {row["field"]: (row["value"], row["unit"]) for row in records(book_of(made)["header"])}
    assert found["height_mm"] == (900, "mm")
    assert found["cleaned"] == (1, None)
    assert found["of_another"] == ("=x", None)
    assert found["distance_m"] == (24.6, "m")
    assert found["video_sha256"] == ("ab" * 32, None)
    assert "edition" not in found


def test_the_joints_are_listed_with_interval_and_residual():
    stated = Stated(
        joints=Joints(
            use=True, marked=tuple(Mark(frame=frame, pixel=(127.5, 79.5)) for frame in (32, 65, 97))
        )
    )
    fields = report().rig.model_dump(mode="json")
    fields["pipe"]["segment_length_mm"] = 1600.0
    adjusted = adjust(track_of(24.6), Rig.model_validate(fields), stated, [])
    made = report(corrected=Corrected(stated, adjusted, None))
    found = records(book_of(made)["joints"])
    assert len(found) >= 2
    assert {(row["frame"], row["is_marked"]) for row in found} <= {(32, 1), (65, 1), (97, 1)}
    for row, joint in zip(found, adjusted.evidence, strict=True):
        assert row["joint_no"] == joint.number
        assert row["distance_m"] == pytest.approx(joint.distance_mm / 1000, abs=0.0006)
        assert row["distance_u95_m"] == half_width_m(joint.sigma_mm)
        assert row["residual_mm"] == pytest.approx(joint.residual_mm, abs=0.06)


def test_the_log_states_what_moved_a_distance_by_whom_and_why():
    made = report()
    tag = made.entries[2]
    stated = {"lengths": [{"first_frame": 0, "last_frame": 499, "length_m": 24.6, "sigma_mm": 5.0,
                           "kind": "tape"}]}  # fmt: skip
    events = [
        ("created", None, None, {"name": "x", "header": {}}),
        ("corrected", None, {}, stated),
        ("created", tag.id, None, {"frame": 7}),
        ("changed", tag.id, {"frame": 7}, {"frame": 7, "code": "BAB"}),
        ("changed", tag.id, {"frame": 7}, {"frame": 9, "pixel": [4.0, 5.5]}),
        ("deleted", tag.id, {"frame": 9}, None),
    ]
    log = tuple(
        Event(inspection_id=made.id, observation_id=about, action=action, who="Ali",
              at=AT + timedelta(minutes=n), before=before, after=after, remark=f"why {n}")
        for n, (action, about, before, after) in enumerate(events)
    )  # fmt: skip
    found = records(book_of(report(events=log))["corrections"])
    assert [(row["what"], row["seq"], row["who"], row["why"]) for row in found] == [
        ("corrected", None, "Ali", "why 1"), ("moved", tag.seq, "Ali", "why 4"),
    ]  # fmt: skip
    assert found[0]["before"] == "nothing"
    assert "frames 0 to 499 are 24.600 m apart" in found[0]["after"]
    assert (found[1]["before"], found[1]["after"]) == ("frame 7", "frame 9, pixel 4 5.5")
    assert found[1]["at"] == "2026-09-14T09:46:00+00:00"


def test_every_column_of_every_sheet_is_explained():
    book = book_of(report())
    explained = {(row["sheet"], row["column"]) for row in records(book["dictionary"])}
    assert explained == {
        (sheet.title, cell.value) for sheet in data_of(book) for cell in next(sheet.iter_rows())
    }
    assert all(row["meaning"] for row in records(book["dictionary"]))
    units = {row["column"]: row["unit"] for row in records(book["dictionary"])}
    assert all(units[c.name] == "m" for c in DICTIONARY if c.name.endswith("_m"))


def test_a_text_longer_than_a_cell_is_cut_and_reported():
    written = write(report(observations=[{"distance_m": 1.0, "remark": "x" * 40_000}]))
    (loss,) = [loss for loss in said(written.losses) if "cut" in loss]
    assert "40000 characters in column remark" in loss
    sheet = openpyxl.load_workbook(io.BytesIO(written.content))["observations"]
    assert len(records(sheet)[0]["remark"]) == 32_767


def test_the_same_report_gives_the_same_bytes():
    assert write(report()).content == write(report()).content


@given(made=reports())
def test_any_report_is_a_workbook_that_states_its_distances(made):
    read = records(book_of(made)["observations"])
    assert [row["distance_m"] for row in read] == [entry.distance_m for entry in made.entries]
    assert [row["seq"] for row in read] == [entry.seq for entry in made.entries]
    for row, entry in zip(read, made.entries, strict=True):
        if entry.tag.remark and entry.tag.remark.isprintable():
            assert row["remark"] == entry.tag.remark


def test_a_carriage_return_ends_a_line_and_is_not_shown():
    made = report(observations=[{"distance_m": 1.0, "remark": "one\r\ntwo\rthree"}])
    content = write(made).content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert not any(b"_x000D_" in archive.read(name) for name in archive.namelist())
    head, row = openpyxl.load_workbook(io.BytesIO(content))["observations"].values
    assert row[head.index("remark")] == "one\ntwo\nthree"
