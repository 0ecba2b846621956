"""How a delivery to a client stands, by what the client said about it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

AnswerKind = Literal["accepted", "question"]
Standing = Literal["open", "question", "answered", "accepted", "changed"]
"""open: nothing was said; question: one waits for an answer; answered: it has one, and the client
has said nothing since; changed: the inspection is no longer what was accepted."""

USUAL_DAYS, MOST_DAYS = 30, 365
"""How long a link is valid."""
MOST_SECTIONS = 200
"""Inspections of one link."""
MOST_ANSWERS = 50
"""About one section, by one link: who has it can fill no disk."""


class Said(Protocol):
    """An answer, as far as the standing depends on it."""

    kind: str
    version: str
    reply: str | None


def standing(answers: Sequence[Said], version: str | None) -> Standing:
    """Return how a section stands.

    Args:
        answers: What clients said about it, the oldest first.
        version: Of the inspection now; None if it was deleted.
    """
    if not answers:
        return "open"
    if any(answer.kind == "question" and answer.reply is None for answer in answers):
        return "question"
    last = answers[-1]
    if last.kind == "question":
        return "answered"
    return "accepted" if last.version == version else "changed"
