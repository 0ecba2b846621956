"""What a code pack declares: bounds, grades, ratings, mapping; and what is said of a faulty one."""

from pathlib import Path

import pytest
from reports import ENGLISH, entry, report

from app.errors import InvalidPack
from app.reports.content.grade_words import rule_of
from app.reports.content.grades import grade_of
from app.reports.exchange.rows import rows_of
from app.survey.catalogue import built_in, example_pack
from app.survey.catalogue.columns import NEEDED, OPTIONAL, RATING_NEEDED, THRESHOLDS
from app.survey.catalogue.ratings import Rating, rate
from app.survey.catalogue.read import read_table

pytestmark = pytest.mark.unit

PACK = read_table("Invented", example_pack())
HEADER = ",".join(NEEDED)
EXTRA = "min_q1,max_q1,grade_by,grade_1,grade_2,grade_3,grade_4,grade_5,en13508,finding"
ROW = "SPL,T,L,Split,S,no,yes,mm,no,,no"
RATINGS = "\nrating,label,of,rule,grade_1,grade_2,grade_3,grade_4,grade_5"


def content(*rows, header=HEADER):
    return "\n".join([header, *rows]).encode()


def faults(*rows, header=HEADER):
    with pytest.raises(InvalidPack) as refused:
        read_table("Ours", content(*rows, header=header))
    return str(refused.value)


def made_by_pack(*entries):
    return report(observations=(), entries=entries, pack=PACK.name, ratings=PACK.ratings)


def declared(seq, code, char1=None, char2=None, **stated):
    kind = PACK.named(code, char1, char2)
    return entry(seq, kind=kind, code=code, char1=char1, char2=char2, **stated)


def test_every_column_is_explained_where_a_licence_holder_looks():
    page = (Path(__file__).parents[3] / "docs" / "code_packs.md").read_text("utf-8")
    columns = {*NEEDED, *OPTIONAL, *RATING_NEEDED} - set(THRESHOLDS)
    assert {name for name in columns if f"`{name}`" not in page} == set()


def test_the_example_says_what_a_pack_can_say():
    split = PACK.find("SPL", "W", "L")
    assert len(PACK.rows) == 26
    assert (split.bounds[0], split.grade_by) == ((1.0, 200.0), "q1")
    assert (split.grades, split.en13508) == ((None, None, 1.0, 10.0, 25.0), ("BAB", "C", "A"))
    assert PACK.of_finding("crack", "along").label_in("de") == "Spalt: fein, der Länge nach"
    assert PACK.of_finding("deposit", "invert").code == "SED"
    assert PACK.of_finding("crack") is built_in().of_finding("crack", "along") is None
    assert PACK.named("SPL", "W", None).en13508 is None, "it is not known yet which of them"


@pytest.mark.parametrize(
    ("cells", "fault"),
    [
        ("5,1,,,,,,,,", "min_q1 (5) is greater than max_q1 (1)"),
        ("low,,,,,,,,,", "min_q1 must be empty or a number such as 2.5 (found 'low')"),
        (",,q1,,,,,,,", "grade_by and at least one of grade_1 to grade_5 go together"),
        (",,q2,1,,,,,,", "grade_by is q2, but needs_q2 is no"),
        (",,q1,3,,2,,,,", "grade_3 (2) must be greater than grade_1 (3)"),
        (",,,,,,,,BAB Q Q,", "en13508: EN 13508-2 has no code 'BAB Q Q'"),
        (",,,,,,,,BBA A,", "en13508: unit_q1 is mm, but BBA A has %"),
        (",,,,,,,,,Crack!", "finding must be empty or a kind of finding"),
    ],
)
def test_a_fault_in_what_is_declared_is_named(cells, fault):
    assert f"line 2: {fault}" in faults(f"{ROW},{cells}", header=f"{HEADER},{EXTRA}")


@pytest.mark.parametrize(
    ("rows", "fault"),
    [
        (("A,X,S,peak,,,,,",), "line 5: rating must be 2 to 16 capital letters"),
        (
            ("AA,X,S,guess,,,,,",),
            "line 5: rule must be one of peak, mean, sum, per_m, count, quick",
        ),
        (("AA,X,Q,peak,,,,,",), "line 5: of names 'Q', which is neither a group"),
        (("AA,X,BB,peak,,,,,", "BB,X,AA,peak,,,,,"), "line 5: of names 'BB', which is neither"),
        (("AA,X,AA,peak,,,,,",), "line 5: of names 'AA', which is neither"),
        (("AA,X,S,peak,,,,,", "AA,X,S,sum,,,,,"), "line 6: the rating AA is already in line 5"),
        (("AA,X,S,quick,1,,,,",), "line 5: grade_1 to grade_5 must be empty"),
        (("AA,X,S,sum,3,2,,,",), "line 5: grade_2 (2) must be greater than grade_1 (3)"),
    ],
)
def test_ratings_name_only_what_stands_above_them(rows, fault):
    assert fault in faults(ROW, RATINGS, *rows)


def test_empty_cells_that_a_spreadsheet_adds_are_no_fault():
    table = read_table(
        "Ours", content(f"{ROW},,", f"{RATINGS},,,", "AA,Peak,S,peak,,,,,,,", header=f"{HEADER},,")
    )
    assert [rating.name for rating in table.ratings] == ["AA"]


@pytest.mark.parametrize(
    ("rule", "thresholds", "value", "grade"),
    [
        ("peak", (), 5, 5), ("mean", (), 3, 3), ("sum", (), 12, None), ("count", (), 4, None),
        ("sum", (1, 5, 12, 20, 40), 12, 3), ("per_m", (None, 0.5, None, 1.2, 9), 1.2, 4),
        ("quick", (), 5, 5), ("count", (9, 10, 11, 12, 13), 4, 0),
    ],
)  # fmt: skip
def test_a_section_is_rated_by_the_rule_and_the_thresholds(rule, thresholds, value, grade):
    (rated,) = rate(
        [Rating("A", "A", ("S", "O"), rule, thresholds)], {"S": [5, 3, 0], "O": [3, 1]}, 10
    )
    assert (rated.value, rated.grade) == (value, grade)
    assert rated.quick == ("5×1 3×2" if rule == "quick" else "")


def test_a_rule_without_defects_or_length_says_nothing():
    rules = [Rating("AA", "A", ("S",), "mean"), Rating("BB", "B", ("AA",), "peak")]
    assert [one.value for one in rate(rules, {}, 10)] == [None, None]
    (per_m,) = rate([Rating("A", "A", ("S",), "per_m")], {"S": [3]}, None)
    assert (per_m.value, per_m.grade) == (None, None)


def test_the_grade_of_an_asset_is_that_of_the_last_rating_and_says_why():
    report = made_by_pack(
        declared(1, "SPL", "W", "L", quant1=12.0, distance_m=2.0),
        declared(2, "SEE", "R", distance_m=3.0),
        declared(3, "SPL", "T", "L", quant1=0.05, distance_m=4.0),
        declared(4, "SED", distance_m=5.0),
        declared(5, "LVL", quant1=10.0, distance_m=6.0),
    )
    grade = grade_of(report)
    assert (grade.rule, grade.grade, grade.word, grade.worst.seq) == ("pack", 4, "declared.4", 1)
    assert [(one.entry.seq, one.value, one.threshold) for one in grade.inputs] == [
        (1, 4, "10–25 mm"), (2, 3.0, ""), (3, 0, "< 0.1 mm"),
    ]  # fmt: skip
    assert [(one.entry.seq, one.reason) for one in grade.unclassified] == [(4, "no_quantity")]
    said = rule_of(grade, ENGLISH)
    assert "Shell, quick (two highest grades with their number): 4×1 → grade 4" in said
    assert any(one.startswith("Mean of all defects") and "3.5 → grade 4" in one for one in said)


def test_exchange_files_have_the_code_of_the_standard_and_name_what_has_none():
    report = made_by_pack(
        declared(1, "SPL", "W", "L", quant1=12.0, distance_m=2.0),
        declared(2, "SHD", "F", quant1=7.0, distance_m=3.0),
        declared(3, "NST", distance_m=4.0),
    )
    rows, losses = rows_of(report)
    assert [(row.code, row.char1, row.char2, row.quant1) for row in rows] == [
        ("BAB", "C", "A", 12.0), ("BAC", "C", "", None), ("BDB", "", "", None),
    ]  # fmt: skip
    assert [row.remark.partition(", +/-")[0] for row in rows] == [
        "coded SPL W L", "coded SHD F, 7", "coded NST",
    ]  # fmt: skip
    assert [loss.entry.seq for loss in losses if loss.key == "foreign_code"] == [3]
