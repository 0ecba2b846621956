"""The words of the reports: the same in every language, all there, all used."""

import json
import re
from pathlib import Path
from typing import get_args

import pytest
from reports import AT

from app.imports.surveys.survey import Caveat
from app.reports import formats
from app.reports.content.condition import SEVERITIES, Overall
from app.reports.content.translator import Translator
from app.reports.content.words import LANGUAGES, words_of
from app.reports.report import Loss, Phrase, WhyLost, failure
from app.survey.adjustment.adjusted_track import Refusal
from app.survey.fields.header import FIELDS
from app.survey.observations import checks
from app.survey.observations.records import Event
from app.survey.observations.undelivered import CODES
from vo_core.errors import InvalidTrack
from vo_core.image.health import Health, complaints

FOLDER = Path(formats.__file__).parent


def written(language):
    """What the file of a language holds, without what English lends it."""
    areas = json.loads((FOLDER / f"content/words/{language}.json").read_text("utf-8"))
    return {f"{area}.{name}": text for area in areas for name, text in areas[area].items()}


ENGLISH = words_of("en")
OTHERS = [language for language in LANGUAGES if language != "en"]
SOURCE = "\n".join(
    path.read_text("utf-8")
    for pattern in ("*.py", "templates/*.html", "templates/*.typ")
    for path in [
        *FOLDER.rglob(pattern),
        FOLDER.parent / "viewer/wording.py",
        FOLDER.parent / "web/routers/server/accept.py",
    ]
)
NAMED = set(re.findall(r"[\"']([a-z_]+\.(?!html\b|json\b|typ\b)\w+)[\"']", SOURCE))
AREAS = {
    area
    for pattern in (r"f\"([a-z]+)\.\w*\{", r"one_of\(\"(\w+)\"", r"\"([a-z_]+)\.\" ~")
    for area in re.findall(pattern, SOURCE)
}
"""Of which a key is put together."""


def placeholders(sentence):
    return sorted(re.findall(r"\{(\w+)\}", sentence))


@pytest.mark.parametrize("language", OTHERS)
def test_a_language_has_the_keys_of_english_with_the_same_values(language):
    assert {key: placeholders(text) for key, text in written(language).items()} == {
        key: placeholders(text) for key, text in ENGLISH.items()
    }


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_key_is_without_words(language):
    assert [key for key, text in written(language).items() if not text.strip()] == []


def test_what_a_language_lacks_is_said_in_english(monkeypatch):
    monkeypatch.setattr("app.reports.content.words._read", lambda language: {
        "en": {"a.one": "one", "a.two": "two"}, "xx": {"a.one": "eins"}
    }[language])  # fmt: skip
    words_of.cache_clear()
    try:
        assert words_of("xx") == {"a.one": "eins", "a.two": "two"}
    finally:
        words_of.cache_clear()


def test_why_the_client_was_not_notified_is_said_in_the_language_of_the_report():
    assert in_area("undelivered") == set(CODES)
    failed = {"inspection_id": "", "at": AT, "who": "Chainage", "action": "not_told"}
    t = Translator("ms", "m")
    assert t.remark(Event(**failed, remark="It answered 503.")) == "Ia menjawab 503."
    assert t.remark(Event(**failed, remark="Lain.")) == "Lain."
    assert t.remark(Event(**failed | {"action": "changed"}, remark="It answered 503.")) == (
        "It answered 503."
    )


def test_each_loss_that_a_format_names_has_a_sentence():
    named = set(re.findall(r"Loss\(\s*f?\"([\w{}]+)\"", SOURCE))
    keys = {
        key.format(what=what, name=name, why=why, content=why)
        for key in named
        for what in ("photo", "voice")
        for why in get_args(WhyLost)
        for name in ("start_node", "end_node")
    }
    assert len(keys) > 40
    assert keys == in_area("loss")


def test_each_caveat_of_an_import_has_a_sentence():
    calls = r"(?:Caveat|_BadBlock|\.add|\.warn)\(\s*\"(\w+)\""
    source = "\n".join(
        path.read_text("utf-8")
        for room in ("imports", "inspections")
        for path in FOLDER.parent.joinpath(room).rglob("*.py")
    )
    named = set(re.findall(calls, source))
    around = {"at_line", "of_survey", "nothing_imported"}
    assert len(named) > 30
    assert named <= in_area("caveat")
    assert {
        key for key in in_area("caveat") - around if not re.search(rf"\b{key}\b", source)
    } == set()


def test_a_caveat_is_said_in_the_language_of_the_reader():
    caveat = Caveat("unknown_value", 7, {"field": "shape", "value": "'X'", "own": "o"}, "C1")
    assert Translator("en", "m").caveat(caveat) == (
        "C1: Line 7: Cross-section: 'X' is not known; it is kept as o."
    )
    assert Translator("de", "m").caveat(caveat) == (
        "C1: Zeile 7: Profil: 'X' ist nicht bekannt; es bleibt als o erhalten."
    )
    lacking = Caveat("not_brought", values={"named": ("film", "wall")})
    assert "der Film, das Bild der Wand." in Translator("de", "m").caveat(lacking)


def test_a_loss_is_said_in_the_language_of_the_report():
    loss = Loss("only_json", named=(Phrase("part.joints"), Phrase("part.history")))
    assert Translator("en", "m").loss(loss) == "Only the JSON report has the joints, the history."
    assert Translator("ms", "m").loss(loss) == "Hanya laporan JSON mempunyai sambungan, sejarah."
    within = Loss("line_ends").in_format("en13508")
    assert Translator("ms", "m").loss(within) == "EN 13508-2: Penghujung baris dalam teks ialah LF."
    unknown = Loss("no_clip", reason=failure(InvalidTrack("The track has a gap.")))
    assert Translator("ms", "m").loss(unknown) == "Tiada klip: The track has a gap."


def test_no_key_is_there_for_nothing():
    assert {key for key in ENGLISH if key not in NAMED and key.split(".")[0] not in AREAS} == set()


def test_every_key_that_the_code_names_is_there():
    areas = {key.split(".")[0] for key in ENGLISH}
    assert {key for key in NAMED if key.split(".")[0] in areas} <= ENGLISH.keys()


def test_every_header_field_and_choice_has_words():
    choices = {choice for field in FIELDS for choice in field.choices} | {"yes", "no"}
    assert in_area("field") == {"project", *(field.name for field in FIELDS)}
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


@pytest.mark.parametrize(
    ("language", "said"),
    [
        ("en", ("12.40 m", "2026-09-14", "EUR 1,250.50", "2.5 mm", "1:02:03.4")),
        ("de", ("12,40 m", "14.09.2026", "1.250,50 EUR", "2,5 mm", "1:02:03,4")),
        ("ms", ("12.40 m", "14/09/2026", "EUR 1,250.50", "2.5 mm", "1:02:03.4")),
    ],
)
def test_figures_days_and_amounts_are_written_as_the_language_does(language, said):
    t = Translator(language, "m")
    found = (
        t.length(12.4), t.value("date", "2026-09-14"), t.money(1250.5, "EUR"),
        t.value("unit_mm", 2.5), t.time(3723.46),
    )  # fmt: skip
    assert found == said


def test_why_joints_do_not_count_is_said_in_the_language_of_the_report():
    refusal = Refusal("English.", "uncountable", {"n": 9, "segment_mm": 1500.0})
    assert Translator("ms", "m").refusal(refusal).startswith("Unit paip 1500 mm tidak dapat dikira")
    assert Translator("ms", "m").refusal(Refusal("English.", None, {})) == "English."


@pytest.mark.parametrize("subject", ["inspection", "observation"])
def test_whatever_the_history_of_the_page_names_has_a_word_in_the_report(subject):
    words = json.loads((FOLDER.parent.parent / "static/words/en.json").read_text("utf-8"))
    actions = words[f"history_{subject}"]
    assert len(actions) >= 6
    assert {f"action.{subject}_{action}" for action in actions} <= ENGLISH.keys()
