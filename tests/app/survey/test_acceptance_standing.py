"""How a delivery stands by what its client said."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from app.survey.observations.acceptance import standing

pytestmark = pytest.mark.unit


@dataclass
class Said:
    kind: str
    version: str = "1"
    reply: str | None = None


ACCEPTED, ASKED, REPLIED = Said("accepted"), Said("question"), Said("question", reply="Yes.")


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ([], "open"),
        ([ACCEPTED], "accepted"),
        ([Said("accepted", "0")], "changed"),
        ([ASKED, ACCEPTED], "question"),  # two people at once: none of them is passed over
        ([ACCEPTED, ASKED], "question"),
        ([ACCEPTED, REPLIED], "answered"),
        ([REPLIED, ACCEPTED], "accepted"),
    ],
)
def test_a_question_without_reply_counts_first_then_what_was_said_last(said, expected) -> None:
    assert standing(said, "1") == expected


def test_what_was_deleted_is_accepted_no_more() -> None:
    assert standing([ACCEPTED], None) == "changed"
