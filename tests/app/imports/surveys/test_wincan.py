"""WinCan .db3: tables are read, missing ones are reported, and hostile files are refused."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from reports import ENGLISH
from wincan_files import project

from app.errors import InvalidImport
from app.imports.surveys.wincan import looks_like, read


def test_a_project_is_read_field_by_field(tmp_path: Path) -> None:
    content = project(tmp_path / "p.db3")
    assert looks_like(content)
    file = read(content)
    survey, empty = file.surveys
    assert survey.name == "CUL-7 2020-07-10"
    assert survey.header == {
        "asset_id": "CUL-7", "start_node": "HW-2", "end_node": "HW-1",
        "direction": "against_flow", "date": "2020-07-10", "time": "09:42:00",
        "operator": "Operator 1", "shape": "circular", "height_mm": 900.0, "width_mm": 900.0,
        "material": "Concrete", "end_condition": "complete", "unit_length_m": 2.44,
        "expected_length_m": 24.6, "location_text": "Jalan Besar",
    }  # fmt: skip
    start, crack, end = survey.observations
    assert (start.code, start.char1, start.time_s) == ("BCD", "XP", 0.0)
    assert (crack.code, crack.char1, crack.char2) == ("BAB", "B", "A")
    assert (crack.distance_m, crack.quant1, crack.clock_from, crack.time_s) == (3.2, 2.5, 11, 41.0)
    assert crack.remark == "crack"
    assert (crack.photo or "").endswith("CUL-7_1.jpg")
    assert end.distance_m == 24.6
    assert [ENGLISH.caveat(it) for it in survey.warnings] == [
        "An observation BAC has no distance and is left out."
    ]
    assert [ENGLISH.caveat(it) for it in file.warnings] == [
        "1 observations belong to no inspection and are left out."
    ]
    assert (empty.name, empty.observations) == ("CUL-8", ())


def test_codes_stretches_grades_and_media_of_other_countries_are_kept(tmp_path: Path) -> None:
    columns = (
        "OBS_PK, OBS_Inspection_FK, OBS_Distance, OBS_OpCode, OBS_CD_Code1, OBS_GradeS, "
        "OBS_ClockPos1, OBS_TimeCtr, OBS_Radial, OBS_SyncTimeStamp"
    )
    rows = (
        "('a', 'i2', 1, 'H', 'S01', 4, '6.5', 'soon', 'deep', '2020')",
        "('b', 'i2', 3, 'H', 'F01', 0, '3', '00:00:41', NULL, '2020')",
        "('c', 'i2', 10, 'AEDSTZ', '0', 10, '', '', 0, '2020')",
    )
    media = (
        "('a', 'Video\\run 1.mp4', 'MP4', 'VI1')", "('a', 'one.jpg', 'JPG', 'PI1')",
        "('a', 'two.JPG', 'JPG', 'PI2')", "('b', 'one', '', 'PI1')", "('b', 'scan.ipf', '', '')",
    )  # fmt: skip
    statements = (
        f"CREATE TABLE SECOBS ({columns})",
        f"INSERT INTO SECOBS VALUES {', '.join(rows)}",  # noqa: S608
        "CREATE TABLE SECOBSMM (OMM_Observation_FK, OMM_FileName, OMM_FileType, OMM_Type)",
        f"INSERT INTO SECOBSMM VALUES {', '.join(media)}",  # noqa: S608
        "ALTER TABLE SECINSP ADD COLUMN INS_InspectedLength REAL",
        "ALTER TABLE SECTION ADD COLUMN OBJ_PipeJointLength REAL",
        "UPDATE SECINSP SET INS_InspectedLength = 30.5",
        "UPDATE SECTION SET OBJ_PipeJointLength = 2.5",
    )  # fmt: skip
    file = read(project(tmp_path / "p.db3", without=("SECOBS", "SECOBSMM"), more=statements))
    survey = file.surveys[1]
    start, finish, change = survey.observations
    assert [(it.code, it.char1, it.stretch) for it in survey.observations] == [
        ("H", None, "A1"), ("H", None, "B1"), ("AED", "STZ", None),
    ]  # fmt: skip
    assert (start.photo, finish.photo, finish.time_s) == ("one.jpg", "one", 41.0)
    assert start.remark == "clock 6.5, video soon, structural grade 4, photo two.JPG"
    assert (finish.remark, change.remark) == ("file scan.ipf", "structural grade 10")
    assert survey.header["video_files"] == "Video\\run 1.mp4"
    assert (survey.surveyed_m, survey.header["unit_length_m"]) == (30.5, 2.5)
    assert [ENGLISH.caveat(it) for it in file.warnings] == [
        "The table SECOBS states more than is read, which is left out: OBS_Radial."
    ]
    assert {it.key for it in survey.warnings} == {"no_hour", "no_video_time"}


def test_tables_that_are_not_there_are_reported(tmp_path: Path) -> None:
    file = read(project(tmp_path / "p.db3", without=("NODE", "SECOBSMM")))
    assert [ENGLISH.caveat(it) for it in file.warnings[:2]] == [
        "There is no table NODE: nodes have no names.",
        "There is no table SECOBSMM: photos are not named.",
    ]
    assert file.surveys[0].header["start_node"] == "n2"
    assert "key is kept" in ENGLISH.caveat(file.surveys[0].warnings[0])


def test_a_project_that_was_in_use_is_read_without_its_log(tmp_path: Path) -> None:
    assert len(read(project(tmp_path / "p.db3", wal=True)).surveys) == 2


@pytest.mark.parametrize("table", ["SECTION", "SECINSP", "SECOBS"])
def test_a_database_of_another_program_is_refused_with_its_tables(
    tmp_path: Path, table: str
) -> None:
    content = project(tmp_path / "p.db3", without=(table,))
    with pytest.raises(InvalidImport, match=f"no table {table}.*NODE"):
        read(content)


@pytest.mark.parametrize(
    "statement",
    [
        "CREATE VIEW SECOBS AS SELECT * FROM NODE",
        "CREATE VIEW SECOBS AS WITH RECURSIVE n(OBS_PK) AS (SELECT 1 UNION ALL SELECT OBS_PK+1 "
        "FROM n) SELECT OBS_PK, load_extension('x') FROM n",
        "CREATE VIRTUAL TABLE SECOBS USING fts5(OBS_PK)",
    ],
)
def test_a_view_or_a_virtual_table_is_not_asked(tmp_path: Path, statement: str) -> None:
    content = project(tmp_path / "p.db3", without=("SECOBS",), more=(statement,))
    with pytest.raises(InvalidImport, match="no table SECOBS"):
        read(content)


def test_a_column_that_is_worked_out_is_not_read(tmp_path: Path) -> None:
    columns = (
        "OBS_PK TEXT, OBS_Inspection_FK TEXT, OBS_Distance REAL, OBS_OpCode TEXT, OBS_Memo TEXT "
        "GENERATED ALWAYS AS (zeroblob(400000000)) VIRTUAL, OBS_X TEXT AS (zeroblob(1e9))"
    )
    statements = (
        f"CREATE TABLE SECOBS ({columns})",
        "INSERT INTO SECOBS (OBS_PK, OBS_Inspection_FK, OBS_Distance) VALUES ('a', 'i1', 2.5)",
    )
    file = read(project(tmp_path / "p.db3", without=("SECOBS",), more=statements))
    (observation,) = file.surveys[0].observations
    assert (observation.distance_m, observation.remark) == (2.5, "")
    assert "computes these columns, which are not read: OBS_Memo" in ENGLISH.caveat(
        file.warnings[0]
    )


def test_a_trigger_is_never_run(tmp_path: Path) -> None:
    trigger = "CREATE TRIGGER t AFTER INSERT ON SECOBS BEGIN DELETE FROM SECINSP; END"
    assert len(read(project(tmp_path / "p.db3", more=(trigger,))).surveys) == 2


def test_what_is_no_database_is_refused() -> None:
    for content in (b"", b"hello", b"SQLite format 3\0", b"SQLite format 3\0" + bytes(5000)):
        with pytest.raises(InvalidImport):
            read(content)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return project(tmp_path_factory.mktemp("db") / "p.db3")


@given(data=st.data())
def test_a_damaged_database_is_read_or_refused(sound: bytes, data: st.DataObject) -> None:
    damaged = bytearray(sound)
    places = st.integers(16, len(sound) - 1)
    for place in data.draw(st.lists(places, min_size=1, max_size=40)):
        damaged[place] = data.draw(st.integers(0, 255))
    with suppress(InvalidImport):
        assert read(bytes(damaged)).surveys
