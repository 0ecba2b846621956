"""The words of the reports that people read, in each of their languages."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources

from app.reports.report import Language


@cache
def words_of(language: Language) -> Mapping[str, str]:
    """Return every sentence by its key, such as `cover.title`; placeholders are in braces."""
    text = resources.files(__name__).joinpath(f"{language}.json").read_text("utf-8")
    areas: Mapping[str, Mapping[str, str]] = json.loads(text)
    return {
        f"{area}.{name}": sentence
        for area, sentences in areas.items()
        for name, sentence in sentences.items()
    }
