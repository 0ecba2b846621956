"""What films get by rules and tables, and how what is wrong with these is reported."""

from __future__ import annotations

from typing import Any

import pytest
from builders import clip_rig
from pydantic import ValidationError

from app.archive.assignment import Assignment
from app.archive.rules import Rules
from app.archive.tables import MOST_ROWS, read_table
from app.errors import InvalidTable

FLOOR = {"floor": clip_rig()}


def rules(*given: dict[str, Any], rigs: dict[str, Any] = FLOOR) -> Rules:
    named = [{"name": f"rule {n}", **rule} for n, rule in enumerate(given)]
    return Rules.model_validate({"rigs": rigs, "rules": named})


def assigned(found: Rules, relative: str, *tables: str, priority: int | None = None) -> Any:
    read = [read_table(text, "the table") for text in tables]
    return Assignment(found).assigned_to(f"/films/{relative}", relative, read, priority)


def test_the_first_rule_that_fits_wins() -> None:
    found = rules({"pattern": "a/*"}, {"pattern": "**", "rig": "floor", "priority": 3})
    assert assigned(found, "a/x.mp4").rule == "rule 0"
    film = assigned(found, "b/x.mp4")
    assert (film.rule, film.rig_name, film.priority, film.error_code) == (
        "rule 1",
        "floor",
        3,
        None,
    )
    assert film.rig["pipe"]["shape"] == "flat"


def test_fields_of_the_pattern_fill_project_asset_name_and_header() -> None:
    pattern = "{project}/{asset}_{date}_{height_mm}_{van}.mp4"
    film = assigned(
        rules({"pattern": pattern, "rig": "floor", "name_of_film": "{asset} by van {van}",
               "header": {"client": "Roads"}}),
        "North/C-7_20260331_900_2.mp4",
    )  # fmt: skip
    assert (film.project, film.asset, film.name) == ("North", "C-7", "C-7 by van 2")
    assert film.header == {"client": "Roads", "date": "2026-03-31", "height_mm": 900}


def test_a_field_that_does_not_fit_the_header_is_left_out_and_named() -> None:
    film = assigned(rules({"pattern": "{date}_*", "rig": "floor"}), "20261399_x.mp4")
    assert film.rig is not None
    assert film.header == {}
    assert film.error_code == "invalid_header"
    assert "2026-13-99" in film.error_detail


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        (rules(), "no_rule", "No rule fits"),
        (rules({"pattern": "**"}), "no_rig", "'rule 0' gives no rig"),
        (rules({"pattern": "**", "rig": "other"}), "rig_missing", "no rig 'other'"),
        (
            rules({"pattern": "**", "rig": "x"}, rigs={"x": clip_rig(fx=-1.0)}),
            "invalid_rig",
            "camera.fx",
        ),
    ],
)
def test_why_a_film_has_no_rig_is_said(given: Rules, code: str, words: str) -> None:
    film = assigned(given, "x.mp4")
    assert (film.rig, film.error_code) == (None, code)
    assert words in film.error_detail


@pytest.mark.parametrize(
    ("rule", "place", "words"),
    [
        ({"pattern": "a//b"}, ("rules", 1, "pattern"), "slash"),
        ({"pattern": "{assset}.mp4"}, ("rules", 1), "{assset}"),
        ({"pattern": "*", "project": "{year}"}, ("rules", 1), "{year}"),
        ({"pattern": "*", "colour": "red"}, ("rules", 1, "colour"), "not permitted"),
        ({"pattern": "*", "priority": 10}, ("rules", 1, "priority"), "less than or equal to 9"),
        ({"pattern": "*", "header": {"year": "old"}}, ("rules", 1, "header"), "year"),
    ],
)
def test_an_invalid_rule_is_refused_with_its_place(
    rule: dict[str, Any], place: tuple[Any, ...], words: str
) -> None:
    with pytest.raises(ValidationError) as refused:
        rules({"pattern": "*"}, rule)
    (fault,) = refused.value.errors()
    assert fault["loc"] == place
    assert words in fault["msg"]


def test_a_table_states_header_and_rig_by_film_or_asset() -> None:
    found = rules({"pattern": "{asset}.mp4", "project": "P", "header": {"client": "Roads"}})
    by_file = "file;rig;name;cleaned;height_mm\nC-1.MP4;floor;First;yes;1200,5\n"
    film = assigned(found, "C-1.mp4", by_file)
    assert (film.rig_name, film.name, film.project, film.asset) == ("floor", "First", "P", "C-1")
    assert film.header == {"client": "Roads", "cleaned": True, "height_mm": 1200.5}
    by_asset = "# a comment\nasset_id,client\nc-1,Rivers\n"
    assert assigned(found, "C-1.mp4", by_file, by_asset).header["client"] == "Rivers"
    assert assigned(found, "C-1.mp4", by_asset).header["client"] == "Rivers"
    assert assigned(found, "C-2.mp4", by_asset).header["client"] == "Roads"


def test_rows_that_no_film_has_are_named() -> None:
    table = read_table("file,client\na.mp4,A\nb.mp4,B\n", "the table")
    Assignment(rules()).assigned_to("/films/x/A.mp4", "x/A.mp4", [table])
    (sentence,) = table.unused()
    assert sentence == "Line 3 of the table names 'b.mp4', which is not among the films."


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("file,colour\na.mp4,red\n", ["Line 1", "'colour'"]),
        ("client\nA\n", ["Line 1", "none of the columns"]),
        ("file,file\n", ["twice"]),
        ("file,year,date\na.mp4,old,\nb.mp4,,yesterday\n", ["line 2: year", "line 3: date"]),
        ("file,priority\na.mp4,high\n", ["line 2: priority"]),
        ("file,client\na.mp4,A\nA.mp4,B\n", ["line 3: 'a.mp4' has a line already"]),
        ("file,client\n,A\n", ["line 2: file is empty"]),
        ("file,client\na.mp4,A,B\n", ["line 2 has 3 cells"]),
        ('file,client\na.mp4,"A\n', ["quotation marks"]),
        ("", ["Line 1"]),
        ("file\na.mp4\n" + "\n" * MOST_ROWS, [f"more than {MOST_ROWS} rows"]),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_table_is_named_with_its_line(text: str, words: list[str]) -> None:
    with pytest.raises(InvalidTable) as refused:
        read_table(text, "the table")
    assert [word for word in words if word.lower() not in str(refused.value).lower()] == []
