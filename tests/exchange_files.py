"""Exchange files written and read back, for the tests of each format."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from exchange_readers import (
    Read,
    read_en13508,
    read_en13508_xml,
    read_isybau,
    read_m150,
    read_ribx,
)
from reports import OBSERVATIONS, said

from app.reports.formats import FORMATS
from app.reports.report import Loss, Report, Written

READERS: dict[str, Callable[[bytes], Read]] = {
    "en13508": read_en13508, "en13508xml": read_en13508_xml, "ribx": read_ribx,
    "isybau": read_isybau, "m150": read_m150,
}  # fmt: skip

CODE = {
    "en13508": "A",
    "en13508xml": "A",
    "ribx": "A",
    "isybau": "InspektionsKode",
    "m150": "HZ002",
}

REMARK = {"en13508": "F", "en13508xml": "F", "ribx": "F", "isybau": "Kommentar", "m150": "HZ010"}

DISTANCE = {"en13508": "I", "en13508xml": "I", "ribx": "I", "isybau": "Station", "m150": "HZ001"}

PHOTO = {"en13508": "M", "en13508xml": "M", "ribx": "M", "isybau": "Fotodatei", "m150": "HZ009"}

each = pytest.mark.parametrize("kind", list(READERS))


def write(kind: str, made: Report) -> tuple[Read, tuple[Loss, ...]]:
    """What the file says, and its losses, each of which makes a sentence."""
    written: Written = FORMATS[kind].write(made)
    assert all(sentence.endswith(".") for sentence in said(written.losses))
    return READERS[kind](written.content), tuple(written.losses)


def in_words(number: int) -> str:
    """What our writers put behind the remark of an observation of OBSERVATIONS."""
    fields = OBSERVATIONS[number]
    u95_cm = -(-round(1000 * (0.02 + 0.0025 * fields["distance_m"])) // 10)
    parts = [
        f"joint {fields['joint_no']}" if "joint_no" in fields else "",
        f"+/-{u95_cm / 100:.2f} m",
        f"severity {fields['severity']}" if "severity" in fields else "",
    ]
    return ", ".join(part for part in parts if part)
