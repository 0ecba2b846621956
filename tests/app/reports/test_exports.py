import csv
import io
import json

import pytest
from builders import STEP_MM, Client, assert_error
from surveys import Survey, another

from app.reports.tables.table import COLUMNS
from app.reports.text.naming import ascii_file_name, safe_file_name
from app.survey.catalogue import built_in


def rows_of(client: Client, inspection_id: str) -> list[dict[str, str]]:
    content = client.get(f"/api/inspections/{inspection_id}/exports/csv").content
    return list(csv.DictReader(io.StringIO(content.decode("utf-8-sig"))))


@pytest.fixture(scope="module")
def report(survey: Survey, shared: Client) -> str:
    """An inspection with three observations."""
    header = {
        "asset_id": "=CUL", "known_length_m": 2.5,
        "start_lat": 3.139, "start_lon": 101.6869, "end_lat": 3.14, "end_lon": 101.6869,
    }  # fmt: skip
    inspection_id = another(survey, shared, name="Jalan Besar / 7", header=header)
    shared.tag(
        inspection_id, frame=10, pixel=[127.5, 79.5], code="BAB", char1="B", char2="A",
        quant1=2, clock_from=11, severity=3, continuous="A1", remark="=HYPERLINK(1)",
    )  # fmt: skip
    shared.tag(inspection_id, frame=35, code="BAB", char1="B", char2="A", continuous="B1")
    shared.tag(inspection_id, frame=20, remark="-12, see photo\nnext line")
    return inspection_id


def test_the_csv_states_what_was_tagged_and_opens_in_an_office_program(
    shared: Client, report: str
) -> None:
    first, plain, finish = rows_of(shared, report)
    expected = {
        "code": "BAB", "char2": "A", "quant1": "2.0", "unit1": "mm", "clock_from": "11",
        "cont_role": "start", "video_file": "short.mp4", "video_time_s": "0.400", "frame": "10",
        "photo_file": "CUL-001.jpg", "at_joint": "0", "lat": "3.1390064", "lon": "101.6869",
        "tagged_by": "server", "seq": "1", "number": "1", "remark": "'=HYPERLINK(1)",
    }  # fmt: skip
    assert {name: first[name] for name in expected} == expected
    assert float(first["distance_m"]) == pytest.approx(10 * STEP_MM / 1000, abs=0.001)
    assert float(first["distance_to_go_m"]) == pytest.approx(2.484, abs=0.001)
    assert float(first["cont_length_m"]) == pytest.approx(0.04, abs=0.002)
    assert (finish["number"], finish["seq"], finish["cont_role"]) == ("3", "2", "finish")
    assert (plain["code"], plain["x_m"], plain["severity"]) == ("", "", "")
    answer = shared.get(f"/api/inspections/{report}/exports/csv")
    assert answer.content.startswith(b"\xef\xbb\xbfreport_id,")
    assert answer.content.count(b"\r\n") == 4
    assert answer.headers["Content-Type"] == "text/csv; charset=utf-8"
    disposition = answer.headers["Content-Disposition"]
    assert disposition.startswith('attachment; filename="Jalan_Besar_7-defects.csv"')


def test_the_csv_for_german_excel_is_not_the_one_of_a_moment_before(
    shared: Client, report: str
) -> None:
    path = f"/api/inspections/{report}/exports/csv"
    standard, german = shared.get(path).content, shared.get(f"{path}?csv=german").content
    assert german.startswith(b"\xef\xbb\xbfreport_id;asset_id;")
    assert (b";2,0;mm;" in german, b",2.0,mm," in standard) == (True, True)
    assert_error(shared.get(f"{path}?csv=french"), 422, "invalid_request")


def test_the_json_holds_everything_under_a_schema_version(shared: Client, report: str) -> None:
    content = shared.get(f"/api/inspections/{report}/exports/json").json()
    assert content["schema"] == "chainage-report/2"
    assert content["inspection"]["rig"]["camera"]["width"] == 256
    assert content["inspection"]["header"]["known_length_m"] == 2.5
    assert content["inspection"]["source"]["sha256"]
    assert [row["seq"] for row in content["observations"]] == [1, 3, 2]
    assert tuple(content["observations"][0]) == COLUMNS
    assert content["observations"][0]["remark"] == "=HYPERLINK(1)"


def test_every_change_is_in_the_record(survey: Survey, shared: Client) -> None:
    changed = another(survey, shared)
    name = shared.tag(changed, code="BAB").json()["id"]
    shared.tag(changed, name, code="BAC")
    shared.tag(changed, name, code="BAC")
    path = f"/api/inspections/{changed}"
    shared.delete(f"{path}/observations/{name}")
    shared.post(f"{path}/observations/{name}/restore")
    shared.patch(path, json={"name": "New"})
    events = shared.get(f"{path}/exports/json").json()["events"]
    assert [event["action"] for event in events] == [
        "created", "created", "changed", "deleted", "restored", "changed",
    ]  # fmt: skip
    assert {event["who"] for event in events} == {"server"}
    edit = events[2]
    assert (edit["before"]["code"], edit["after"]["code"]) == ("BAB", "BAC")
    assert (events[3]["before"]["code"], events[3]["after"]) == ("BAC", None)


def test_other_formats_are_refused(shared: Client, done: str) -> None:
    answer = shared.get(f"/api/inspections/{done}/exports/exe")
    assert_error(answer, 422, "invalid_request")


def test_an_inspection_without_observations_exports_an_empty_table(
    shared: Client, done: str
) -> None:
    assert rows_of(shared, done) == []


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("a b.csv", "a_b.csv"),
        ("../../etc/passwd", "etc_passwd"),
        ('x";\r\ny.csv', "x_y.csv"),
        (".hidden", "hidden"),
        ("涵洞", "涵洞"),
        ("DL-Ä41.csv", "DL-Ä41.csv"),
        ("///", "report"),
    ],
)
def test_file_names_are_safe(name: str, safe: str) -> None:
    assert safe_file_name(name) == safe


def test_names_that_differ_in_an_umlaut_stay_apart_in_ascii() -> None:
    names = [ascii_file_name(name) for name in ("DL-Ä41", "DL-Ö41", "DL-Ae41", "DL-41", "涵洞")]
    assert all(name.isascii() for name in names)
    assert len(set(names)) == len(names)
    assert names[0].startswith("DL-Ae41-")
    assert names[2] == "DL-Ae41"


def test_the_code_pack_is_complete(shared: Client) -> None:
    codes = shared.get("/api/codes").json()
    assert len(codes) == 519
    assert len({row["code"] for row in codes}) == 43
    assert codes[3] == {
        "code": "BAB", "char1": "A", "char2": "A",
        "label": "Crack: hairline on the surface, along the pipe",
        "label_ms": "Retak: retak rambut pada permukaan, memanjang paip", "group": "S",
        "needs_clock": "yes", "needs_q1": "opt", "needs_q2": "no", "unit_q1": "mm",
        "unit_q2": None, "continuous_allowed": True, "grade_s": None, "grade_o": None,
        "hotkey": None, "icon": None, "labels": built_in().rows[3].labels,
        "bounds": [[None, None], [None, None]], "grade_by": None, "grades": [],
        "en13508": None, "finding": None,
    }  # fmt: skip
    json.dumps(codes, allow_nan=False)
