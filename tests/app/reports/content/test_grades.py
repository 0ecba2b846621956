"""Condition, order and grades of defects, against classes read off published thresholds by hand."""

import pytest
from reports import HEADER, LENGTH_M, report

from app.reports.content.condition import Overall, condition_of, worst_first
from app.reports.content.grades import grade_of
from app.reports.template import ReportTemplate

CRACK = ("BAB", "B", "A")


def made_of(*observations, rule="structural", **header):
    placed = [{"distance_m": float(n), **fields} for n, fields in enumerate(observations)]
    template = ReportTemplate(grade=rule)
    return report(observations=placed, template=template, header={**HEADER, **header})


def graded(*observations, **how):
    return grade_of(made_of(*observations, **how))


def defect(code, char1=None, char2=None, quant1=None, **more):
    return {"code": code, "char1": char1, "char2": char2, "quant1": quant1, **more}


def rated(*severities, code="BAC"):
    return made_of(*(defect(code, severity=severity) for severity in severities))


def stretch(code, field, *values):
    roles = ("start", "change", "finish")
    return [
        {**defect(*code), "cont_id": 1, "cont_role": role, field: value}
        for role, value in zip(roles, values, strict=True)
    ]


@pytest.mark.parametrize(
    ("severities", "overall"),
    [
        ((), Overall.UNKNOWN), ((None, None), Overall.UNKNOWN), ((0, 1), Overall.EXCELLENT),
        ((1, 3, 2), Overall.FAIR), ((4, 1), Overall.POOR), ((2, 5, 5), Overall.SEVERE),
    ],
)  # fmt: skip
def test_the_worst_severity_decides_the_condition(severities, overall):
    assert condition_of(rated(*severities)).overall is overall


def test_deposits_do_not_count_since_cleaning_removes_them():
    assert condition_of(rated(5, code="BBC")).overall is Overall.UNKNOWN


def test_entries_are_counted_by_severity_and_the_worst_come_first():
    found = condition_of(rated(5, 3, 3, None))
    assert dict(found.counts) == {0: 0, 1: 0, 2: 0, 3: 2, 4: 0, 5: 1}
    assert found.unrated == 1
    assert [one.number for one in worst_first(rated(3, 5, None, 5, 4))] == [2, 4, 5, 1]


def test_overlapping_stretches_cover_their_length_once():
    roles = ((1, "start", 2.0), (2, "start", 4.0), (1, "finish", 6.0), (2, "finish", 8.0))
    made = made_of(
        *(
            {"distance_m": at, "code": "BAB", "cont_id": number, "cont_role": role}
            for number, role, at in roles
        )
    )
    assert condition_of(made).stretch_percent == pytest.approx(100 * 6 / LENGTH_M)


def test_a_stretch_is_one_defect_and_as_severe_as_its_worst_part():
    made = made_of(*stretch(("BAB",), "severity", 2, 4, 3), defect("BAC", severity=4))
    assert dict(condition_of(made).counts) == {0: 0, 1: 0, 2: 0, 3: 0, 4: 2, 5: 0}
    assert [one.seq for one in worst_first(made)] == [one.seq for one in made.defects] == [2, 4]


@pytest.mark.parametrize(
    ("fields", "value", "threshold"),
    [
        ((*CRACK, 0.5), 2, "0.5–2 mm"), ((*CRACK, 1.99), 2, "0.5–2 mm"),
        ((*CRACK, 2.0), 3, "2–5 mm"),
        ((*CRACK, 5.0), 4, "5–10 mm"), ((*CRACK, 10.0), 5, "≥ 10 mm"),
        (("BAC", "B"), 3, ""), (("BAC", "C"), 5, ""), (("BAE", None, None, 19.9), 1, "< 20 mm"),
        (("BAE", None, None, 100.0), 4, "≥ 100 mm"), (("BAJ", "C", None, 3.75), 1, ""),
        (("BAO",), 4, ""), (("BAP",), 5, ""), (("BBF", "D"), 4, ""),
    ],
)  # fmt: skip
def test_a_defect_has_the_class_of_its_threshold(fields, value, threshold):
    found = graded(defect(*fields))
    assert (found.rule, found.grade) == ("structural", value)
    assert [(one.value, one.threshold) for one in found.inputs] == [(value, threshold)]
    assert found.decides(found.inputs[0])


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ((*CRACK, None), "no_quantity"), ((*CRACK, 0.4), "no_rule"),
        (("BAB", "C", "A", 20.0), "no_rule"), (("BAF", "A", "A"), "no_rule"),
        (("BAC", "A"), "no_rule"), (("BBC", "A", None, 60.0), "no_rule"), ((None,), "no_rule"),
    ],
)  # fmt: skip
def test_what_no_certain_threshold_classes_is_listed_and_makes_no_grade(fields, reason):
    found = graded(defect(*fields))
    assert (found.grade, found.word) == (None, "structural.none")
    assert [one.reason for one in found.unclassified] == [reason]


@pytest.mark.parametrize(
    ("material", "grade", "reasons"),
    [
        ("corrugated metal", 4, []), ("PVC", 4, []), ("reinforced concrete", None, ["no_rule"]),
        ("something", None, ["no_material"]),
    ],
)  # fmt: skip
def test_deformation_is_classed_in_pipes_of_metal_and_plastic_only(material, grade, reasons):
    found = graded(defect("BAA", "A", None, 12.0), material=material)
    assert found.grade == grade
    assert [one.reason for one in found.unclassified] == reasons


def test_the_highest_class_decides_and_the_worst_come_first():
    found = graded(
        defect("BAJ", "B", None, 40.0), defect("BAO"), defect("BAF", "A", "A"), defect(*CRACK, 7.0)
    )
    assert (found.grade, found.worst.seq) == (4, 2)
    assert [(one.entry.seq, one.value) for one in found.inputs] == [(2, 4), (4, 4), (1, 1)]
    assert [one.entry.seq for one in found.unclassified] == [3]
    found = graded(*stretch(CRACK, "quant1", 1.0, 6.0, 2.0))
    assert [(one.entry.seq, one.value) for one in found.inputs] == [(2, 4)]


def test_a_pipe_without_defects_has_grade_0_and_one_without_observations_or_rule_none():
    assert graded(defect("BCD", "Z"), defect("BCE", "Z")).grade == 0
    assert graded().grade is None
    assert graded(defect("BAO"), rule="none") is None


def test_the_own_rule_grades_by_the_worst_severity():
    rated = (("BAB", 2), ("BBC", 5), ("BAC", 4), ("BAB", 3), ("BAF", None))
    found = graded(*(defect(code, severity=severity) for code, severity in rated), rule="own")
    assert (found.grade, found.word, found.worst.seq) == (3, "overall.3", 3)
    assert [(one.entry.seq, one.value, one.threshold) for one in found.inputs] == [
        (3, 3, "4"), (4, 2, "3"), (1, 2, "2"),
    ]  # fmt: skip
    reasons = [(one.entry.seq, one.reason) for one in found.unclassified]
    assert reasons == [(2, "cleaned"), (5, "unrated")]
