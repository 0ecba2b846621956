"""The word catalogues agree with each other and with the page, and no text goes past them."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.reports.content.words import LANGUAGES
from app.survey.catalogue.table import LABEL_LANGUAGES

ROOT = Path(__file__).parent.parent
STATIC = ROOT / "static"
WORDS = {
    path.stem: json.loads(path.read_text("utf-8")) for path in (STATIC / "words").glob("*.json")
}
SOURCES = {path: path.read_text("utf-8") for path in sorted(STATIC.rglob("*.js"))}

SAME = re.compile(
    # Numbers and signs, letters and units, formats.
    r"(\W|\d|\b[A-Z]\b|\b(mm|px|min|rms|s|h|No)\b|\{\w+\})*|EN 13508-2"
)
BORROWED = {
    "ms": {"Menu", "Video", "Status", "Unit", "Format", "Logo"},
    "de": {
        "ChArUco", "Code", "Codes", "Dask", "Export", "Export: {name}", "Film", "Gamma",
        "Infiltration", "Link", "Live", "Live, {time}", "Logo", "Material", "Name", "Oval", "Pause",
        "Pixel", "Position", "Problem", "Status", "Text", "Video",
    },
}  # fmt: skip
"""Words that a language shares with English."""
SERVED = {"language.name", "language.needs_script"}
"""What the server reads."""
PLURALS = {"one", "other"}
SPOKEN = re.compile(r"[A-Za-z]{2,}")
ATTRIBUTE = re.compile(r'checked|selected|disabled|[a-z-]+="[^"]*"')
"""A template that is part of a tag."""
UNSPOKEN = {"Chainage", "mm", "px"}
"""The brand, and units that are the same everywhere."""


def flat(node: dict, prefix: str = "") -> Iterator[tuple[str, str | dict[str, str]]]:
    """Every key as 'area.name' with its sentence, or the sentences of its counts."""
    for name, value in node.items():
        if isinstance(value, dict) and not value.keys() <= PLURALS:
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


CATALOGUES = {language: dict(flat(words)) for language, words in WORDS.items()}
ENGLISH = CATALOGUES["en"]
OTHERS = sorted(CATALOGUES.keys() - {"en"})


def sentences(value: str | dict[str, str]) -> list[str]:
    return [value] if isinstance(value, str) else list(value.values())


def placeholders(value: str | dict[str, str]) -> set[str]:
    return {name for text in sentences(value) for name in re.findall(r"\{(\w+)\}", text)}


def without_comments(source: str) -> str:
    return re.sub(r"(?<!\w)/\*.*?\*/|(?<![:'\"`])//[^\n]*", "", source, flags=re.DOTALL)


def used(pattern: str) -> set[str]:
    codes = map(without_comments, SOURCES.values())
    return {found for code in codes for found in re.findall(pattern, code)}


KEYS_USED = used(r"\b(?:t|pieces)\(\s*'([^']+)'")
AREAS_USED = used(r"\bwordFor\(\s*'([^']+)'")


@pytest.mark.parametrize("language", OTHERS)
def test_a_language_has_the_keys_of_english_with_the_same_placeholders(language: str) -> None:
    assert {key: placeholders(text) for key, text in ENGLISH.items()} == {
        key: placeholders(text) for key, text in CATALOGUES[language].items()
    }


def test_the_page_and_the_reports_have_the_same_languages() -> None:
    assert CATALOGUES.keys() == set(LANGUAGES)
    assert set(LANGUAGES) == {"en", *LABEL_LANGUAGES}


def test_every_key_of_the_page_is_in_the_catalogue() -> None:
    assert KEYS_USED - ENGLISH.keys() == set()
    assert {
        area for area in AREAS_USED if not any(key.startswith(f"{area}.") for key in ENGLISH)
    } == set()


def test_every_word_of_the_catalogue_is_used() -> None:
    by_area = {key for key in ENGLISH if key.rpartition(".")[0] in AREAS_USED}
    assert ENGLISH.keys() - KEYS_USED - by_area == SERVED


def test_keys_stand_in_the_source_as_they_are() -> None:
    """A key that is put together could not be compared with the catalogues."""
    for path, text in SOURCES.items():
        if path.name != "words.js":
            assert re.findall(r"(?<![\w.#])(?:t|pieces|wordFor)\((?!\s*')[^)]", text) == [], path


@pytest.mark.parametrize("language", OTHERS)
def test_a_language_is_not_english(language: str) -> None:
    untranslated = {
        key: text
        for key, value in CATALOGUES[language].items()
        for text in sentences(value)
        if text in sentences(ENGLISH[key]) and not SAME.fullmatch(text)
        if text not in BORROWED.get(language, ())
    }
    assert untranslated == {}


def test_no_text_goes_past_the_catalogue() -> None:
    assert in_each_source(texts_in_markup) == {}


def texts_in_markup(code: str) -> list[str]:
    texts = [text for markup in templates(code) for text in spoken_in(markup)]
    return [text for text in texts if text.strip() not in UNSPOKEN]


def test_no_sentence_is_written_in_the_source() -> None:
    assert in_each_source(sentences_in_code) == {}


def sentences_in_code(code: str) -> list[str]:
    code = re.sub(r"new (?:Api)?Error\((?:[^()]|\([^()]*\))*\)", "", code)
    return re.findall(r"""['"`>]([A-Z][a-z’]+ [a-z’]{2,}[^'"`\n]*)""", code)


def in_each_source(find: Callable[[str], list[str]]) -> dict[str, list[str]]:
    """What is found in the sources that have any of it, by the source's path."""
    assert len(SOURCES) > 100
    found = {path: find(without_comments(text)) for path, text in SOURCES.items()}
    return {path.relative_to(STATIC).as_posix(): texts for path, texts in found.items() if texts}


def test_every_error_code_has_words() -> None:
    text = (ROOT / "docs/http_errors.md").read_text("utf-8")
    codes = set(re.findall(r"`([a-z0-9]+(?:_[a-z0-9]+)+|busy)`", text))
    by_the_server = set(re.findall(r"'(\w+)'", _worded_by_the_server()))
    known = {key.removeprefix("error.") for key in ENGLISH if key.startswith("error.")}
    assert codes - known - by_the_server == set()
    assert by_the_server - codes == set()


def test_every_refused_correction_has_words() -> None:
    sources = [*(ROOT / "vo_core").rglob("*.py"), *(ROOT / "app" / "survey").rglob("*.py")]
    calls = [
        node
        for path in sources
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "InvalidCorrection"
    ]
    reasons = {call.args[1].value for call in calls if len(call.args) > 1}
    worded = {key.removeprefix("refusal.") for key in ENGLISH if key.startswith("refusal.")}
    assert len(reasons) > 10
    assert reasons == worded


def _worded_by_the_server() -> str:
    found = re.search(
        r"WORDED_BY_THE_SERVER = new Set\(\[(.*?)\]",
        SOURCES[STATIC / "core/page/words.js"],
        re.DOTALL,
    )
    assert found
    return found[1]


def templates(source: str) -> Iterator[str]:
    """The markup of every html`...`, with its expressions, nested templates included, left out."""
    for start in re.finditer(r"\bhtml`", source):
        yield _markup(source, start.end())


def _markup(source: str, at: int) -> str:
    text = ""
    while source[at] != "`":
        if source.startswith("${", at):
            at = _end_of_expression(source, at + 2)
        else:
            text += source[at]
            at += 1
    return text


def _end_of_expression(source: str, at: int) -> int:
    depth = 1
    while depth:
        match source[at]:
            case "{":
                depth += 1
            case "}":
                depth -= 1
            case "'" | '"' as quote:
                at = source.index(quote, at + 1)
            case "`":
                at = _end_of_template(source, at + 1) - 1
        at += 1
    return at


def _end_of_template(source: str, at: int) -> int:
    while source[at] != "`":
        at = _end_of_expression(source, at + 2) if source.startswith("${", at) else at + 1
    return at + 1


def spoken_in(markup: str) -> list[str]:
    """What a person would read or hear of it."""
    if ATTRIBUTE.fullmatch(markup.strip()):
        return []
    without_keys = re.sub(r"<kbd>.*?</kbd>", "", markup)
    texts = re.split(r"<[^<>]*>", without_keys)
    named = re.findall(r'(?:aria-label|title|placeholder|alt)="([^"]*)"', without_keys)
    return [text for text in [*texts, *named] if SPOKEN.search(text)]
