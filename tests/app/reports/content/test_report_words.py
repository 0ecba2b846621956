"""The words of the reports: the same in both languages, all there, all used."""

import re
from pathlib import Path

import pytest

from app.reports.content.condition import SEVERITIES, Overall
from app.reports.content.translator import Translator
from app.reports.content.words import words_of
from app.survey import checks
from app.survey.adjustment.adjusted_track import Refusal
from app.survey.catalogue.header import FIELDS
from vo_core.image.health import Health, complaints

ENGLISH, MALAY = words_of("en"), words_of("ms")
FOLDER = Path(checks.__file__).parent.parent / "reports"
SOURCE = "\n".join(
    path.read_text("utf-8")
    for pattern in ("*.py", "templates/*.html")
    for path in FOLDER.rglob(pattern)
)
NAMED = set(re.findall(r"[\"']([a-z]+\.\w+)[\"']", SOURCE))
AREAS = {
    area
    for pattern in (r"f\"([a-z]+)\.\w*\{", r"one_of\(\"(\w+)\"", r"\"([a-z]+)\.\" ~")
    for area in re.findall(pattern, SOURCE)
}
"""Of which a key is put together."""


def placeholders(sentence):
    return sorted(re.findall(r"\{(\w+)\}", sentence))


def test_both_languages_have_the_same_keys():
    assert ENGLISH.keys() == MALAY.keys()


def test_both_languages_say_the_same_values():
    assert {key: placeholders(text) for key, text in ENGLISH.items()} == {
        key: placeholders(text) for key, text in MALAY.items()
    }


def test_no_key_is_without_words():
    assert [key for key in ENGLISH if not (ENGLISH[key].strip() and MALAY[key].strip())] == []


def test_no_key_is_there_for_nothing():
    assert {key for key in ENGLISH if key not in NAMED and key.split(".")[0] not in AREAS} == set()


def test_every_key_that_the_code_names_is_there():
    areas = {key.split(".")[0] for key in ENGLISH}

    assert {key for key in NAMED if key.split(".")[0] in areas} <= ENGLISH.keys()


def test_every_header_field_and_choice_has_words():
    choices = {choice for field in FIELDS for choice in field.choices} | {"yes", "no"}

    assert in_area("field") == {field.name for field in FIELDS}
    assert in_area("choice") == choices


def test_every_check_severity_condition_and_complaint_has_words():
    source = Path(checks.__file__).read_text("utf-8")
    codes = set(re.findall(r"\"(?:block|warn)\",\s*\"(?!warn)(\w+)\"", source))

    assert len(codes) > 20
    assert codes <= in_area("check")
    assert in_area("severity") == {*map(str, SEVERITIES), "none"}
    assert in_area("overall") == {str(int(one)) for one in Overall}
    assert in_area("complaint") == set(complaints(Health(0, 0, 1, 0, 1)))


def in_area(area):
    return {key.split(".")[1] for key in ENGLISH if key.startswith(f"{area}.")}


def test_why_joints_do_not_count_is_said_in_the_language_of_the_report():
    refusal = Refusal("English.", "uncountable", {"n": 9, "segment_mm": 1500.0})

    assert Translator("ms", "m").refusal(refusal).startswith("Unit paip 1500 mm tidak dapat dikira")
    assert Translator("ms", "m").refusal(Refusal("English.", None, {})) == "English."


@pytest.mark.parametrize("subject", ["inspection", "observation"])
def test_whatever_the_history_of_the_page_names_has_a_word_in_the_report(subject):
    panel = FOLDER.parent.parent / "static/components/history-panel/history-panel.js"
    table = panel.read_text("utf-8").split(f"const OF_{subject.upper()} = {{")[1].split("};")[0]
    actions = re.findall(r"^  (\w+): \[", table, re.MULTILINE)
    assert len(actions) >= 6
    assert {f"action.{subject}_{action}" for action in actions} <= ENGLISH.keys()
