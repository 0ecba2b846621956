"""Grades, recommendations and costs in the reports for people, as other programs read them."""

import json

import lxml.html
import pypdfium2
import pytest
from reports import advised, report, said

from app.reports import pdf as document
from app.reports.content.recommendations import costs_of, count_without
from app.reports.exchange import chainage_json
from app.reports.formats import FORMATS
from app.reports.html import web_page
from app.reports.pdf import emergency
from app.reports.template import Recommendation, ReportTemplate

ADVICE = {
    9: {"recommendation": "Rebuild the wall.", "cost": 9000.0},
    10: {"recommendation": "Coat the bars.", "cost": 1250.5},
    6: {"cost": 100.25},
}


def made(rule="own", *, costs=True, advice=ADVICE):
    template = ReportTemplate(grade=rule, costs=costs, currency="MYR")
    return advised(report(template=template), advice)


def pdf_text(content):
    with pypdfium2.PdfDocument(content) as pdf:
        return " ".join(" ".join(page.get_textpage().get_text_range() for page in pdf).split())


def html_text(content):
    return " ".join(lxml.html.fromstring(content).text_content().split())


READERS = {
    "pdf": lambda one: pdf_text(document.write(one).content),
    "html": lambda one: html_text(web_page.write(one).content),
}


@pytest.mark.parametrize("text_of", READERS.values(), ids=READERS)
def test_people_read_the_grade_its_source_and_what_was_accepted(text_of):
    text = text_of(made("structural"))
    assert "5 · act at once" in text
    assert "BFR Abwasser" in text
    assert "This is not a DWA grade" in text
    assert "5 · decides" in text
    assert "no published threshold that is certain" in text
    assert "Rebuild the wall." in text
    for amount in ("9,000.00", "1,250.50", "100.25", "10,350.75"):
        assert amount in text
    assert "Defects without a recommendation: 4" in text


@pytest.mark.parametrize("text_of", READERS.values(), ids=READERS)
def test_a_project_may_want_neither_grade_nor_costs(text_of):
    text = text_of(made("none", costs=False))
    assert "Rebuild the wall." in text
    assert "9000" not in text
    assert "Decided by" not in text
    assert "What the grade follows from" not in text


def test_a_proposal_that_nobody_accepted_is_not_printed():
    template = ReportTemplate(recommendations=[Recommendation(text="Anything at all.")])
    text = pdf_text(document.write(report(template=template)).content)
    assert "Anything at all." not in text
    assert "No recommendation was accepted." in text
    assert "Defects without a recommendation: 6" in text


@pytest.mark.parametrize("text_of", READERS.values(), ids=READERS)
def test_a_long_list_of_classes_is_cut_and_says_so(text_of):
    many = [{"distance_m": n / 10, "code": "BAO", "severity": 4} for n in range(100)]
    many += [{"distance_m": 11 + n / 10, "code": "BAF"} for n in range(70)]
    text = text_of(report(observations=many, template=ReportTemplate(grade="structural")))
    assert "and 40 more, none of them worse" in text
    assert "and 10 more; the workbook lists all" in text


def test_costs_are_summed_by_severity_the_severest_first():
    costs = costs_of(made())
    assert list(costs.by_severity.items()) == [(5, 9000.0), (4, 1250.5), (2, 100.25)]
    assert costs.total == 10350.75
    assert costs_of(made(costs=False)) is None


def test_a_stretch_lacks_a_recommendation_once_and_has_one_at_any_of_its_parts():
    assert count_without(made(advice={})) == 6
    assert count_without(made(advice={4: {"recommendation": "Inject."}})) == 5


def test_the_act_now_sheet_says_what_to_do():
    assert "Recommendation: Rebuild the wall." in pdf_text(emergency.write(made()).content)


def test_programs_find_it_in_json_and_are_warned_of_its_loss_elsewhere():
    (entry,) = [
        one
        for one in json.loads(chainage_json.write(made()).content)["observations"]
        if one["seq"] == 9
    ]
    assert (entry["recommendation"], entry["cost"]) == ("Rebuild the wall.", 9000.0)
    assert any("recommendations" in loss for loss in said(FORMATS["en13508"].write(made()).losses))
    assert not any(
        "recommendations" in loss for loss in said(FORMATS["en13508"].write(report()).losses)
    )
