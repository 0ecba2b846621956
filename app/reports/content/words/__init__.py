"""The words of the reports that people read: a file for each language, named by its code.

A language is added by its file alone. English has every key; what another language lacks is said in
English.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Annotated

from pydantic import Field

_ENGLISH = "en"
LANGUAGES = tuple(
    sorted(
        (
            file.name.removesuffix(".json")
            for file in resources.files(__name__).iterdir()
            if file.name.endswith(".json")
        ),
        key=lambda code: (code != _ENGLISH, code),
    )
)
"""Codes of the languages (ISO 639-1), English first."""
LANGUAGE = f"^({'|'.join(LANGUAGES)})$"
"""Pattern of such a code."""
Language = Annotated[str, Field(pattern=LANGUAGE)]


@cache
def words_of(language: Language) -> Mapping[str, str]:
    """Return every sentence by its key, such as `cover.title`; placeholders are in braces."""
    english = {} if language == _ENGLISH else words_of(_ENGLISH)
    return {**english, **_read(language)}


def _read(language: Language) -> Mapping[str, str]:
    text = resources.files(__name__).joinpath(f"{language}.json").read_text("utf-8")
    areas: Mapping[str, Mapping[str, str]] = json.loads(text)
    return {
        f"{area}.{name}": sentence
        for area, sentences in areas.items()
        for name, sentence in sentences.items()
    }
