"""Which findings are known, which code they start from, and what a declaration may say."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import pytest

from app.errors import InvalidDetector
from app.survey.catalogue import built_in, example_pack
from app.survey.catalogue.read import read_table
from app.survey.catalogue.table import CodeTable
from app.survey.findings.declaration import read_declaration
from app.survey.findings.matching import Places
from app.survey.findings.records import Finding
from app.survey.findings.suggestions import Sector, suggested


def finding(*outline: tuple[float, float], kind: str = "crack", **more: Any) -> Finding:
    values: dict[str, Any] = {"length": None, "width": None, "direction": None, "score": 0.5}
    values |= {"inspection_id": "i", "id": "f", "detector": "classical", "version": "1"}
    values |= {"frame": None, "pixel": None, "found_at": datetime(2026, 1, 1, tzinfo=UTC)}
    return Finding(kind=kind, outline_mm=outline, **values | more)


def started(
    found: Finding, width_mm: float | None, sector: Sector | None, table: CodeTable
) -> dict[str, Any]:
    return suggested(found, width_mm, sector, table, table.named)


@pytest.mark.parametrize(
    ("outline", "kind", "is_known"),
    [
        (((1000, 0), (1300, 10)), "crack", True),
        (((1012, 8), (1290, -6)), "crack", True),  # the odometry is not the same twice
        (((1200, 0), (1280, 5)), "crack", True),  # a piece of it
        (((1000, 0), (2000, 10)), "crack", False),  # it goes on for much longer
        (((1000, 300), (1300, 300)), "crack", False),
        (((1000, 0), (1300, 10)), "hole", False),
    ],
)
def test_what_was_decided_is_known_by_place_and_kind(
    outline: tuple[tuple[float, float], ...], kind: str, *, is_known: bool
) -> None:
    known = Places([finding((1000, 0), (1300, 10))])
    assert (known.of(finding(*outline, kind=kind)) is not None) == is_known


@pytest.mark.parametrize(
    ("kind", "direction", "sector", "expected"),
    [
        ("crack", "along", Sector(3, None), ("BAB", "B", "A", 2.4, 3, None)),
        ("crack", "across", Sector(2, 5), ("BAB", "B", "B", 2.4, 2, 5)),
        ("crack", "oblique", None, ("BAB", "B", "D", 2.4, None, None)),
        ("joint_open", None, Sector(12, 12), ("BAJ", "A", None, 2.4, None, None)),
        ("joint_displaced", None, Sector(12, 12), ("BAJ", "B", None, None, 12, 12)),
        ("hole", None, Sector(9, 10), ("BAC", "B", None, None, 9, 10)),
        ("spall", None, Sector(9, 10), ("BAF", "B", "E", None, 9, 10)),
        ("deposit", None, Sector(5, 7), ("BBC", None, None, None, 5, 7)),
        ("deposit", None, Sector(7, 9), ("BBB", None, None, None, 7, 9)),
        ("roots", None, Sector(1, None), ("BBA", None, None, None, 1, None)),
        ("water", None, Sector(1, None), ("BBF", "C", None, None, 1, None)),
        ("stain", None, Sector(1, None), ("BBF", "A", None, None, 1, None)),
        ("lost_shoe", None, Sector(1, None), (None, None, None, None, 1, None)),
    ],
)
def test_each_kind_starts_from_a_code_of_the_built_in_pack(
    kind: str, direction: Any, sector: Sector | None, expected: tuple[object, ...]
) -> None:
    found = finding((0, 0), (100, 0), kind=kind, direction=direction)
    fields = started(found, 2.42, sector, built_in())
    names = ("code", "char1", "char2", "quant1", "clock_from", "clock_to")
    assert tuple(fields.get(name) for name in names) == expected


def test_a_pack_without_the_code_leaves_it_to_the_person() -> None:
    fields = started(finding((0, 0), kind="roots"), None, Sector(3, None), CodeTable("own", ()))
    assert fields == {"clock_from": 3}


def test_a_pack_says_of_which_code_a_kind_begins() -> None:
    found = finding((0, 0), direction="along")
    fields = started(found, None, None, read_table("Invented", example_pack()))
    assert fields == {"code": "SPL", "char1": "T", "char2": "L"}


def test_a_model_may_name_its_own_code() -> None:
    found = finding((0, 0), kind="lost_shoe", code={"code": "BBE", "char1": "C"})
    assert started(found, None, None, built_in()) == {"code": "BBE", "char1": "C"}


GOOD = "{name: A, task: segment, input: [64, 64], mm_per_px: 1, output: labels, classes: [%s]}"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (GOOD % "{}", "no class has a kind"),
        (GOOD % "{kind: crack}, {kind: crack}", "the same kind"),
        (GOOD % "{kind: Crack}", r"classes\.0\.kind"),
        (GOOD.replace("segment", "detect") % "{kind: crack}", "not one of a model that detects"),
        (GOOD.replace("[64, 64]", "[64, 99999]") % "{kind: crack}", r"input\.1"),
        (GOOD.replace("input", "imput") % "{kind: crack}", "imput"),
        ("a: &a [1]\nb: *a", "aliases"),
        ("name: !!python/object/apply:os.getcwd []", "neither YAML nor JSON"),
        ("{", "neither YAML nor JSON"),
        ("[" * 9000, "neither YAML nor JSON"),
        ("x" * 20_001, "20000 characters"),
    ],
)
def test_a_wrong_declaration_is_refused_with_its_reason(text: str, why: str) -> None:
    with pytest.raises(InvalidDetector, match=why):
        read_declaration(text)


def test_json_is_a_declaration_too() -> None:
    text = (GOOD % "{kind: crack}").replace("{", "{ ")
    assert read_declaration(text).classes[0].kind == "crack"
