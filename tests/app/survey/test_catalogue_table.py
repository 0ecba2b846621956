"""Tables of codes: the built-in one and its Malay, and what is said of a CSV file with faults."""

import pytest
from pydantic import TypeAdapter

from app.errors import InvalidPack
from app.survey.catalogue import built_in
from app.survey.catalogue.columns import NEEDED
from app.survey.catalogue.read import MAX_BYTES, MAX_ROWS, read_table
from app.survey.catalogue.table import LABEL_LANGUAGES
from app.survey.given import CodeName, Letter

HEADER = ",".join(NEEDED)
CRACK = "BAB,C,A,Crack,S,yes,yes,mm,no,,yes"


def content(*rows: str, header: str = HEADER) -> bytes:
    return "\n".join([header, *rows]).encode()


def faults(*rows: str, header: str = HEADER) -> str:
    with pytest.raises(InvalidPack) as refused:
        read_table("Ours", content(*rows, header=header))
    return str(refused.value)


def test_the_built_in_pack_has_all_codes_of_the_standard():
    rows = built_in().rows
    assert len(rows) == 519
    assert len({row.code for row in rows}) == 43
    assert (rows[0].code, rows[-1].code) == ("BAA", "BDG")


@pytest.mark.parametrize(
    ("code", "char1", "label"),
    [
        ("AEC", "E", "Change of shape: arch"),
        ("AED", "AE", "Change of material: clay"),
        ("AED", "STZ", "Change of material: clay, German letters"),
        ("AEF", "", "Change of pipe unit length"),
    ],
)
def test_what_changes_along_the_pipe_can_be_coded(code: str, char1: str, label: str) -> None:
    found = built_in().named(code, char1, "")
    assert found
    assert (found.label, found.char1, found.needs_clock) == (label, char1, "no")
    assert TypeAdapter(CodeName).validate_python(code)
    assert not char1 or TypeAdapter(Letter).validate_python(char1)


def test_every_label_is_translated_phrase_by_phrase():
    rows = built_in().rows  # a phrase without a translation would have raised
    assert all(row.label_ms and row.label_ms != row.label for row in rows)
    crack = built_in().find("BAB", "A", "A")
    assert crack.label == "Crack: hairline on the surface, along the pipe"
    assert crack.label_ms == "Retak: retak rambut pada permukaan, memanjang paip"


def test_what_stands_within_brackets_belongs_to_its_phrase():
    start = built_in().find("BCD", "A", "P")
    assert start.label == "Start: manhole, pipe end (with X: German XP)"
    assert start.label_ms == "Mula: lurang, hujung paip (bersama X = XP Jerman)"


@pytest.mark.parametrize("language", LABEL_LANGUAGES)
def test_two_rows_that_differ_in_english_differ_in_another_language_too(language: str) -> None:
    english: dict[str, set[str]] = {}
    for row in built_in().rows:
        english.setdefault(row.labels[language], set()).add(row.label)
    assert {label: labels for label, labels in english.items() if len(labels) > 1} == {}


@pytest.mark.parametrize(
    ("code", "chars", "label"),
    [
        ("BAB", ("C", "A"), "Crack: open gap, along the pipe"),
        ("BAB", (None, None), None),
        ("BAB", ("Q", "Q"), None),
        ("BAC", ("A", "Z"), "Broken wall: pieces moved, still there"),
    ],
)
def test_the_row_that_fits_best_is_found(code, chars, label):
    found = built_in().find(code, *chars)
    assert (found.label if found else None) == label
    assert found is None or found.label_in("xx") == found.label, "a language that it lacks"


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("separator", [b",", b";"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_a_table_is_read_as_spreadsheets_write_it(mark, separator, end):
    text = content(CRACK, "", ",,,,,,,,,,").replace(b",", separator).replace(b"\n", end)
    (row,) = read_table("Ours", mark + text).rows
    assert row.key == ("BAB", "C", "A")
    assert (row.unit_q1, row.unit_q2, row.continuous_allowed) == ("mm", None, True)
    assert row.label_ms == row.label  # as the file has none


def test_optional_columns_are_kept_and_columns_may_stand_in_any_order():
    header = "hotkey,icon,grade_o,grade_s,label_ms,Label,CODE," + HEADER.replace(
        "code,", "", 1
    ).replace("label,", "", 1)
    (row,) = read_table(
        "Ours", content("b,crack,,3.5,Retak,Crack,BAB,C,A,S,yes,yes,mm,no,,yes", header=header)
    ).rows
    assert (row.hotkey, row.icon, row.grade_s, row.grade_o) == ("b", "crack", 3.5, None)
    assert (row.label, row.label_ms) == ("Crack", "Retak")


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        ("bab,C,A,Crack,S,yes,yes,mm,no,,yes", "line 2: code must be 1 to 8 capital letters"),
        ("BAB,c,A,Crack,S,yes,yes,mm,no,,yes", "line 2: char1 must be empty, a capital letter"),
        ("BAB,C,ABCDE,Crack,S,yes,yes,mm,no,,yes", "line 2: char2 must be empty, a capital letter"),
        ("BAB,C,A,,S,yes,yes,mm,no,,yes", "line 2: label must be a line of 1 to 200"),
        ("BAB,C,A,Crack,Q,yes,yes,mm,no,,yes", "line 2: group must be S, O, C or M (found 'Q')"),
        ("BAB,C,A,Crack,S,maybe,yes,mm,no,,yes", "line 2: needs_clock must be yes, no or opt"),
        ("BAB,C,A,Crack,S,yes,yes,cubits,no,,yes", "line 2: unit_q1 must be empty or one of mm, %"),
        ("BAB,C,A,Crack,S,yes,yes,,no,,yes", "line 2: unit_q1 is missing, as needs_q1 is yes"),
        ("BAB,C,A,Crack,S,yes,yes,mm,no,,opt", "line 2: continuous_allowed must be yes or no"),
        ("BAB,C,A,Crack,S,yes,yes", "line 2: 7 cells for 11 columns"),
        ("BAB,C,A,Crack, with comma,S,yes,yes,mm,no,,yes", "line 2: 12 cells for 11 columns"),
        ('BAB,C,A,"Crack,S,yes,yes,mm,no,,yes', "cannot be read as CSV"),
    ],
)
def test_a_fault_is_reported_with_its_line(row, fault):
    reported = faults(row)
    assert fault in reported
    assert reported.startswith("The table has a fault: ") or "CSV" in fault


@pytest.mark.parametrize(
    ("column", "cell", "fault"),
    [
        ("grade_s", "high", "grade_s must be empty or a number from 0 to 100 (found 'high')"),
        ("grade_o", "101", "grade_o must be empty or a number from 0 to 100 (found '101')"),
        ("hotkey", "ü", "hotkey must be empty or a key such as b or Shift+B"),
        ("icon", "../x", "icon must be empty or a name of small letters"),
    ],
)
def test_a_fault_in_an_optional_column_is_reported(column, cell, fault):
    assert fault in faults(f"{CRACK},{cell}", header=f"{HEADER},{column}")


def test_a_code_or_a_hotkey_that_is_there_twice_names_both_lines():
    assert faults(CRACK, "BAC,A,,Broken,S,no,no,,no,,no", CRACK) == (
        "The table has a fault: line 4: BAB C A is already in line 2."
    )
    reported = faults(f"{CRACK},b", "BAC,A,,Broken,S,no,no,,no,,no,b", header=f"{HEADER},hotkey")
    assert "line 3: the hotkey b is already in line 2" in reported


def test_columns_that_miss_are_not_known_or_are_there_twice_are_reported_together():
    reported = faults(CRACK, header=HEADER.replace("group", "grupe").replace("label", "code"))
    assert "line 1: missing columns: label, group" in reported
    assert "line 1: unknown columns (allowed are" in reported
    assert "'grupe'" in reported
    assert "line 1: repeated columns: code" in reported


def test_of_many_faults_the_first_twenty_are_reported_and_the_rest_is_counted():
    reported = faults(*["x"] * 50)
    assert reported.startswith("The table has 50 faults: line 2: ")
    assert "line 21: " in reported
    assert "line 22: " not in reported
    assert reported.endswith("; and 30 more.")


@pytest.mark.parametrize("file", [b"", b"\n\n", content(), content("", "")])
def test_a_file_without_codes_is_refused(file):
    with pytest.raises(InvalidPack, match=r"missing columns|no row of codes"):
        read_table("Ours", file)


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_another_encoding_is_refused_with_the_way_out(encoding):
    with pytest.raises(InvalidPack, match=r"not in UTF-8\. Save the table as CSV in UTF-8"):
        read_table("Ours", content(CRACK.replace("Crack", "Rïss")).decode().encode(encoding))


def test_the_number_of_rows_and_the_size_are_bounded():
    rows = [f"B{n:05d},,,Crack,S,no,no,,no,,no" for n in range(MAX_ROWS + 1)]
    assert len(read_table("Ours", content(*rows[:-1])).rows) == MAX_ROWS
    assert f"more than {MAX_ROWS} rows" in faults(*rows)
    with pytest.raises(InvalidPack, match="bytes; a pack may have"):
        read_table("Ours", b"x" * (MAX_BYTES + 1))


@pytest.mark.parametrize(
    ("code", "char1", "char2", "label", "label_ms"),
    [
        ("BAC", None, None, "Broken wall", "Dinding pecah"),
        ("BAC", "Q", None, "Broken wall", "Dinding pecah"),
        ("BAC", "C", None, "Broken wall: fallen in", "Dinding pecah: runtuh"),
    ],
)
def test_a_code_has_a_name_with_and_without_its_kind(code, char1, char2, label, label_ms):
    found = built_in().named(code, char1, char2)
    assert (found.label, found.label_ms) == (label, label_ms)
    assert built_in().named("QQQ", None, None) is None, "a code of another table"


def test_very_many_columns_are_refused_shortly_in_work_that_grows_with_them():
    """Counting each name among all would be 10^11 comparisons."""
    reported = faults(header=",".join([*(f"x{n}" for n in range(100_000)), *["code"] * 60_000]))
    assert "repeated columns: code" in reported
    assert len(reported) < 2000
