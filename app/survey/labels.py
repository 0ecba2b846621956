"""Labels of inspections: what one may be, and how many an inspection has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, StringConstraints

from app.survey.folding import folded
from app.survey.given import LINE

Label = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=50, pattern=LINE)
]
Labels = Annotated[list[Label], Field(max_length=20)]


def distinct(labels: Sequence[str]) -> tuple[str, ...]:
    """Return the labels without those that only differ in case or accents from one before."""
    return tuple({folded(label): label for label in reversed(labels)}.values())
