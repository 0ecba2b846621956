"""The built-in code pack: EN 13508-2:2003+A1:2011 pipe codes BAA..BDG with labels of our own.

The letters are facts from KWB-R/kwb.en13508.2 (MIT); no sentence of the standard is copied.  The
flags guide a form; none of them may stop an import.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from importlib import resources

from app.survey.catalogue.table import CodeTable, read_table
from vo_core.csv_rows import named_rows

CODE_PACK = "EN 13508-2:2003+A1:2011"

_BETWEEN_PHRASES = re.compile(r"((?:: |, )(?![^()]*\)))")
"""Separators of a label: a title, a colon and details; text in brackets belongs to its phrase."""


@cache
def built_in() -> CodeTable:
    """Return the codes of the standard, in its order."""
    folder = resources.files(__name__)
    table = read_table(CODE_PACK, folder.joinpath("en13508_2_2003.csv").read_bytes())
    text = folder.joinpath("labels_ms.csv").read_text("utf-8")
    _, phrases = named_rows(text, ("english", "malay"), "table of labels")
    malay = {row["english"]: row["malay"] for _, row in phrases}
    rows = (replace(row, label_ms=translated(row.label, malay)) for row in table.rows)
    return CodeTable(CODE_PACK, tuple(rows))


def translated(label: str, phrases: dict[str, str]) -> str:
    """Translate a label phrase by phrase.

    Raises:
        KeyError: A phrase has no translation.
    """
    parts = _BETWEEN_PHRASES.split(label)
    parts[::2] = [phrases[phrase] for phrase in parts[::2]]
    return "".join(parts)
