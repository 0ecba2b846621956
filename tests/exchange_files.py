"""Exchange files written and read back, for the tests of each format."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest
from brought_in import reported
from exchange_readers import (
    Read,
    read_en13508,
    read_en13508_xml,
    read_isybau,
    read_m150,
    read_ribx,
)
from reports import said

from app.imports import any_file
from app.imports.surveys.survey import ImportedFile, ImportedSurvey
from app.reports.formats import FORMATS
from app.reports.report import Loss, Photo, Report
from app.survey.fields.observation import codes_of

READERS: dict[str, Callable[[bytes], Read]] = {
    "en13508": read_en13508, "en13508xml": read_en13508_xml, "ribx": read_ribx,
    "isybau": read_isybau, "m150": read_m150,
}  # fmt: skip
STANDARD = ("en13508", "en13508xml", "ribx")
each = pytest.mark.parametrize("kind", list(READERS))
each_of_the_standard = pytest.mark.parametrize("kind", STANDARD)

FULL_OBSERVATION: Mapping[str, Any] = {
    "distance_m": 7.318, "u95_m": 0.037, "raw_m": 7.402, "source": "closure", "to_go_m": 17.282,
    "joint_no": 6, "at_joint": True, "code": "BAB", "char1": "B", "char2": "A", "quant1": 18.25,
    "quant2": 4.5, "clock_from": 9, "clock_to": 11, "cont_id": 7, "cont_role": "start",
    "severity": 4, "remark": "at the mill; \"there\"", "time_s": 61.37, "frame": 1841,
    "x_m": 7.311, "y_m": 0.121, "z_m": 0.434, "lon": 9.0001054, "lat": 51.4525321,
    "tagged_by": "Olga", "photo": Photo("CUL-0041-001.jpg", None, "cd" * 32),
}  # fmt: skip
"""An observation with a value of its own in each field."""


def column(kind: str, name: str) -> str:
    """The column of a format that holds a field of an observation."""
    return codes_of("en" if kind in STANDARD else kind)[name][0]


def write(kind: str, made: Report) -> tuple[Read, tuple[Loss, ...]]:
    """What the file says, and its losses, each of which makes a sentence."""
    written = FORMATS[kind].write(made)
    assert all(sentence.endswith(".") for sentence in said(written.losses))
    return READERS[kind](written.content), tuple(written.losses)


def survey_in(content: bytes) -> ImportedSurvey:
    """The only survey of a file."""
    file = any_file.read(content)
    assert isinstance(file, ImportedFile)
    (survey,) = file.surveys
    return survey


def assert_comes_back(kind: str, made: Report) -> ImportedSurvey:
    """Export, import, export: the same bytes, and nothing to warn of."""
    first = FORMATS[kind].write(made).content
    survey = survey_in(first)
    assert survey.warnings == ()
    again = FORMATS[kind].write(reported(made, survey)).content
    assert again.decode("latin-1").splitlines() == first.decode("latin-1").splitlines()
    return survey
