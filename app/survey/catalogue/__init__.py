"""The built-in code pack: codes of EN 13508-2:2003+A1:2011 for pipes (BAA..BDG), and for what
changes along them (AEA..AEG), with labels of our own.

The letters are facts from KWB-R/kwb.en13508.2 (MIT); no sentence of the standard is copied.  The
flags guide a form; none of them may stop an import.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib import resources

from app.survey.catalogue.read import STANDARD_CODES, read_table
from app.survey.catalogue.table import LABEL_LANGUAGES, CodeTable, title_of
from vo_core.csv_rows import records

CODE_PACK = "EN 13508-2:2003+A1:2011"

_BETWEEN_PHRASES = re.compile(r"((?:: |, )(?![^()]*\)))")
"""Separators of a label: a title, a colon and details; text in brackets belongs to its phrase."""


@cache
def built_in() -> CodeTable:
    """Return the codes of the standard, in its order."""
    folder = resources.files(__name__)
    table = read_table(CODE_PACK, folder.joinpath(STANDARD_CODES).read_bytes())
    phrases = {language: _phrases(language) for language in LABEL_LANGUAGES}
    rows = (
        replace(row, labels={name: translated(row.label, words) for name, words in phrases.items()})
        for row in table.rows
    )
    return CodeTable(CODE_PACK, tuple(rows))


def labels_of(label: str | None) -> Mapping[str, str]:
    """Return a built-in label in other languages, for rows that hold the label and not its pack.

    A label of an imported pack has none.
    """
    return _labels().get(label or "", {})


def example_pack() -> bytes:
    """Return the table of a made-up pack, as an example and for tests."""
    return resources.files(__name__).joinpath("example_pack.csv").read_bytes()


@cache
def _labels() -> Mapping[str, Mapping[str, str]]:
    """Return the labels of codes with and without their characters, by the English one."""
    rows = built_in().rows
    titles = {
        title_of(row.label): {name: title_of(text) for name, text in row.labels.items()}
        for row in rows
    }
    return titles | {row.label: row.labels for row in rows}


def _phrases(language: str) -> dict[str, str]:
    """Return the words for each English phrase: the second column of `labels_<language>.csv`."""
    text = resources.files(__name__).joinpath(f"labels_{language}.csv").read_text("utf-8")
    rows = records(text)
    next(rows)  # names of the columns
    return {english: words for _, (english, words) in rows}


def translated(label: str, phrases: dict[str, str]) -> str:
    """Translate a label phrase by phrase.

    Raises:
        KeyError: A phrase has no translation.
    """
    parts = _BETWEEN_PHRASES.split(label)
    parts[::2] = [phrases[phrase] for phrase in parts[::2]]
    return "".join(parts)
