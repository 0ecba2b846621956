"""States of the review of an inspection, and which may follow which."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

ReviewState = Literal["draft", "submitted", "in_review", "approved", "reopened"]
RemarkKind = Literal["accepted", "question", "comment"]

DRAFT: ReviewState = "draft"
"""State of a new inspection."""
APPROVED: ReviewState = "approved"
"""State in which nobody changes an inspection."""
REOPENED: ReviewState = "reopened"
"""State of an inspection that was returned to its inspector, with a reason."""

STATES: tuple[ReviewState, ...] = ("draft", "submitted", "in_review", "approved", "reopened")

_NEXT: Mapping[str, tuple[ReviewState, ...]] = {
    "draft": ("submitted",),
    "submitted": ("in_review", "reopened"),
    "in_review": ("approved", "reopened"),
    "approved": ("reopened",),
    "reopened": ("submitted",),
}


def may_follow(state: str, wanted: ReviewState) -> bool:
    """Return whether `wanted` may directly follow `state`."""
    return wanted in _NEXT[state]


def is_for_admins(state: str, wanted: ReviewState) -> bool:
    """Return whether only admins may take this step: into the lock, and out of it."""
    return APPROVED in (state, wanted)
