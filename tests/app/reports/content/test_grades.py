"""Grades by each rule, against classes read off the published thresholds by hand."""

import pytest
from reports import HEADER, report

from app.reports.content.grades import grade_of
from app.reports.template import ReportTemplate


def graded(*observations, rule="structural", **header):
    placed = [{"distance_m": float(n), **fields} for n, fields in enumerate(observations)]
    template = ReportTemplate(grade=rule)
    return grade_of(report(observations=placed, template=template, header={**HEADER, **header}))


def defect(code, char1=None, char2=None, quant1=None, **more):
    return {"code": code, "char1": char1, "char2": char2, "quant1": quant1, **more}


CRACK = ("BAB", "B", "A")


@pytest.mark.parametrize(
    ("fields", "value", "threshold"),
    [
        ((*CRACK, 0.5), 2, "0.5–2 mm"),
        ((*CRACK, 1.99), 2, "0.5–2 mm"),
        ((*CRACK, 2.0), 3, "2–5 mm"),
        ((*CRACK, 3.0), 3, "2–5 mm"),
        ((*CRACK, 5.0), 4, "5–10 mm"),
        ((*CRACK, 10.0), 5, "≥ 10 mm"),
        (("BAC", "B"), 3, ""),
        (("BAC", "C"), 5, ""),
        (("BAE", None, None, 19.9), 1, "< 20 mm"),
        (("BAE", None, None, 100.0), 4, "≥ 100 mm"),
        (("BAJ", "C", None, 3.75), 1, ""),
        (("BAO",), 4, ""),
        (("BAP",), 5, ""),
        (("BBF", "D"), 4, ""),
    ],
)
def test_a_defect_has_the_class_of_its_threshold(fields, value, threshold):
    found = graded(defect(*fields))

    assert (found.rule, found.grade) == ("structural", value)
    assert [(one.value, one.threshold) for one in found.inputs] == [(value, threshold)]
    assert found.decides(found.inputs[0])


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ((*CRACK, None), "no_quantity"),
        ((*CRACK, 0.4), "no_rule"),
        (("BAB", "C", "A", 20.0), "no_rule"),
        (("BAF", "A", "A"), "no_rule"),
        (("BAC", "A"), "no_rule"),
        (("BBC", "A", None, 60.0), "no_rule"),
        ((None,), "no_rule"),
    ],
)
def test_what_no_certain_threshold_classes_is_listed_and_makes_no_grade(fields, reason):
    found = graded(defect(*fields))

    assert found.grade is None
    assert found.word == "structural.none"
    assert [one.reason for one in found.unclassified] == [reason]


@pytest.mark.parametrize(
    ("material", "grade", "reasons"),
    [
        ("corrugated metal", 4, []),
        ("PVC", 4, []),
        ("reinforced concrete", None, ["no_rule"]),
        ("something", None, ["no_material"]),
    ],
)
def test_deformation_is_classed_in_pipes_of_metal_and_plastic_only(material, grade, reasons):
    found = graded(defect("BAA", "A", None, 12.0), material=material)

    assert found.grade == grade
    assert [one.reason for one in found.unclassified] == reasons


def test_the_highest_class_decides_and_the_worst_come_first():
    found = graded(
        defect("BAJ", "B", None, 40.0), defect("BAO"), defect("BAF", "A", "A"), defect(*CRACK, 7.0)
    )

    assert found.grade == 4
    assert [(one.entry.seq, one.value) for one in found.inputs] == [(2, 4), (4, 4), (1, 1)]
    assert found.worst.seq == 2
    assert [one.entry.seq for one in found.unclassified] == [3]


def test_a_stretch_counts_once_with_its_highest_class():
    stretch = [
        defect(*CRACK, size, cont_id=1, cont_role=role)
        for size, role in ((1.0, "start"), (6.0, "change"), (2.0, "finish"))
    ]

    assert [(one.entry.seq, one.value) for one in graded(*stretch).inputs] == [(2, 4)]


def test_a_pipe_without_defects_has_grade_0_and_one_without_observations_none():
    assert graded(defect("BCD", "Z"), defect("BCE", "Z")).grade == 0
    assert graded().grade is None


def test_the_own_rule_grades_by_the_worst_severity():
    found = graded(
        defect("BAB", severity=2),
        defect("BBC", severity=5),
        defect("BAC", severity=4),
        defect("BAB", severity=3),
        defect("BAF"),
        rule="own",
    )

    assert (found.grade, found.word, found.worst.seq) == (3, "overall.3", 3)
    assert [(one.entry.seq, one.value, one.threshold) for one in found.inputs] == [
        (3, 3, "4"), (4, 2, "3"), (1, 2, "2"),
    ]  # fmt: skip
    reasons = [(one.entry.seq, one.reason) for one in found.unclassified]
    assert reasons == [(2, "cleaned"), (5, "unrated")]


def test_a_template_without_grades_has_none():
    assert graded(defect("BAO"), rule="none") is None
