"""The languages of the page: a file `words/<code>.json` for each, named by its code (ISO 639-1).

A language is added by its file alone. `language.name` in it is what the language calls itself.
English has every key; what another file lacks is sent in English.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any

Words = Mapping[str, Any]
"""Sentences by name, within areas."""

_FOLDER = "words"
_ENGLISH = "en"
WORDS = re.compile(rf"{_FOLDER}/([a-z]{{2,3}})\.json")
"""Path of such a file within the folder of static files."""
_COUNTS = frozenset({"zero", "one", "two", "few", "many", "other"})
"""Names of the forms of a sentence with a count (CLDR)."""


@dataclass(frozen=True)
class Language:
    """A language that the page offers."""

    code: str
    name: str
    words: bytes
    """Its file as it is sent: without a gap."""
    needs_script: str
    """What a browser without scripts shows."""


@lru_cache(maxsize=4)
def languages_of(static: Path, _version: str) -> Mapping[str, Language]:
    """Return the languages by code, English first; the version makes changed files another key."""
    found = {path.stem: _read(path) for path in (static / _FOLDER).glob("*.json")}
    english = found[_ENGLISH]
    languages = [_language(code, _filled(words, english)) for code, words in found.items()]
    languages.sort(key=lambda language: (language.code != _ENGLISH, language.name))
    return {language.code: language for language in languages}


def with_languages(page: str, languages: Mapping[str, Language]) -> str:
    """Add to a page the languages that it may choose from, and what it says without scripts."""
    links = "".join(
        f'    <link rel="alternate" type="application/json" hreflang="{code}" '
        f'title="{escape(language.name)}" href="/static/{_FOLDER}/{code}.json" />\n'
        for code, language in languages.items()
    )
    sentences = "".join(
        f'<p lang="{code}">{escape(language.needs_script)}</p>'
        for code, language in languages.items()
    )
    noscript = f"<noscript>{sentences}</noscript>"
    return page.replace("  </head>", f"{links}  </head>", 1).replace(
        "<noscript></noscript>", noscript, 1
    )


def _read(path: Path) -> Words:
    words: Words = json.loads(path.read_bytes())
    return words


def _language(code: str, words: Words) -> Language:
    named = words["language"]
    return Language(
        code, named["name"], json.dumps(words, ensure_ascii=False).encode(), named["needs_script"]
    )


def _filled(words: Words, english: Words) -> Words:
    """Return the words, with the English ones in the gaps.

    A sentence with a count is taken as a whole: its forms differ from language to language.
    """
    whole = dict(english)
    for name, value in words.items():
        is_area = isinstance(value, dict) and not value.keys() <= _COUNTS
        whole[name] = _filled(value, english.get(name, {})) if is_area else value
    return whole
