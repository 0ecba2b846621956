"""Files as spreadsheets and people save them."""

import tracemalloc

import pytest

from vo_core import InvalidTrack
from vo_core.csv_rows import decoded, named_rows, number_columns, plain, records, unquoted


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "a;b\r\n1;2\r\n", "# note\n\n a , b \n\n1,2\n#end"])
def test_a_separator_comments_and_blank_lines_do_not_matter(text):
    columns, rows = named_rows(text, ("a", "b"), "table")
    assert columns == ["a", "b"]
    assert [dict(cells) for _, cells in rows] == [{"a": "1", "b": "2"}]


def test_rows_have_the_numbers_of_their_lines():
    _, rows = named_rows('# note\na,b\n"1\n2",3\n# between\n4,5\n', ("a",), "table")
    assert [line for line, _ in rows] == [4, 6]


def test_columns_that_are_not_needed_may_be_absent():
    columns = number_columns("b,a\n2,1\n4,3\n", ("a",), "table", further=("b", "c"))
    assert {name: column.tolist() for name, column in columns.items()} == {
        "a": [1.0, 3.0],
        "b": [2.0, 4.0],
    }


def test_a_file_without_rows_has_empty_columns():
    assert number_columns("a,b\n", ("a", "b"), "table")["b"].shape == (0,)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a\n1\n", "The table has no column b"),
        ('a,b\n1,"2\n', "cannot be read as CSV"),
        ("a,b\n1,2\n# note\n3\n", "Line 4 of the table is not numbers"),
        ("a,b\n1,inf\n", "Line 2 .* inf is not finite"),
    ],
)
def test_what_cannot_be_read_is_refused_with_a_sentence(text, said):
    with pytest.raises(InvalidTrack, match=said):
        number_columns(text, ("a", "b"), "table")


def test_a_byte_order_mark_is_no_part_of_the_first_name():
    assert decoded("\ufeffa,b".encode()) == "a,b"


def test_another_encoding_is_refused_with_its_line():
    with pytest.raises(InvalidTrack, match="Line 2 is not in UTF-8"):
        decoded(b"a\n\xff\n")


@pytest.mark.parametrize("line", ["\n", "\r", "#\n", ";;\n"])
def test_a_table_of_empty_lines_takes_no_memory_for_each_of_them(line):
    text = "a;b\n" + line * 100_000
    tracemalloc.start()
    try:
        assert [cells for _, cells in records(text)] == [["a", "b"]]
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak_bytes < 100_000


def test_lines_end_as_on_any_system_and_within_quotation_marks_they_stay():
    found = list(records('a,b\r1,"x\r\ny"\r\n\n3,4'))
    assert found == [(1, ["a", "b"]), (3, ["1", "x\r\ny"]), (5, ["3", "4"])]


@pytest.mark.parametrize(
    "text",
    ["=1+1", "+1", "-1", "@SUM(A1)", "|cmd", "\t1", "\r1", "\n1", " =1", "\u00a0 =1", "\u3000=1",
     "\u200b=1", "\ufeff@x", "\uff1d1", "\uff0b1", "\uff0d1", "\uff20x", "\uff5ccmd", " \ufe661",
     "\x00=1"],
)  # fmt: skip
def test_no_text_becomes_a_formula_and_it_comes_back_unchanged(text):
    assert plain(text) == f"'{text}"
    assert unquoted(plain(text)) == text


@pytest.mark.parametrize("text", ["", " ", "a=1", "1-2", "(=1)", "'=1", "\u00e9", "12|13"])
def test_other_texts_stay_as_they_are(text):
    assert plain(text) == text
