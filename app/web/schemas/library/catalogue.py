"""Codes, code packs, fields of the header, preset rigs."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal, Self

from pydantic import BaseModel

from app.inspections.packs import PackView
from app.web.schemas.out import Out


class CodeOut(Out):
    """A row of the code pack."""

    code: str
    char1: str
    char2: str
    label: str
    label_ms: str
    labels: dict[str, str]
    """In other languages than that of `label`, as far as the pack has them."""
    group: str
    needs_clock: str
    needs_q1: str
    needs_q2: str
    unit_q1: str | None
    unit_q2: str | None
    continuous_allowed: bool
    grade_s: float | None
    grade_o: float | None
    hotkey: str | None
    icon: str | None
    bounds: list[list[float | None]]
    """Least and greatest value of both quantities; null: none."""
    grade_by: Literal["q1", "q2"] | None
    """The quantity that grades the defect, if `grade_s` and `grade_o` do not."""
    grades: list[float | None]
    """From which value on it has grade 1 to 5; null where the pack leaves a grade out."""
    en13508: list[str] | None
    """Code and characters of EN 13508-2 that stand for it in exchange files."""
    finding: str | None
    """Kind of an automatic finding that begins as this code."""


class PackOut(Out):
    """A version of an imported code pack."""

    id: str
    name: str
    """As reports print it: the title, with the version from the second on."""
    title: str
    version: int
    project: str | None
    """The only project whose inspections may be coded with it; null: all."""
    codes: int
    ratings: int
    inspections: int
    """How many are coded with it."""
    created_at: datetime
    created_by: str

    @classmethod
    def of(cls, view: PackView) -> Self:
        """Convert the service's view."""
        counts = {name: getattr(view, name) for name in ("codes", "ratings", "inspections")}
        return cls.read_from(view.row, **counts)


class PackPreviewOut(BaseModel):
    """What an import of a pack would add; nothing if there are faults."""

    faults: list[str]
    """All that is wrong, with line or sheet and row; at most 200."""
    codes: list[CodeOut]
    """The first codes, at most 8."""
    count: int
    ratings: list[str]
    """Labels of the ratings of sections."""


class PacksOut(BaseModel):
    """The imported code packs by title, the newest version first; the built-in one has no id and
    is not listed.
    """

    packs: list[PackOut]


class HeaderFieldOut(Out):
    """A known field of the header."""

    name: str
    group: Literal["required", "auto", "more"]
    kind: Literal["text", "number", "choice", "date", "time", "bool"]
    choices: list[str]
    unit: str | None
    minimum: float | None
    maximum: float | None


class HeaderFieldsOut(BaseModel):
    """The known fields in the order of a form."""

    fields: list[HeaderFieldOut]


class PresetOut(BaseModel):
    """An example rig to start from."""

    name: str
    rig: dict[str, Any]


class PresetsOut(BaseModel):
    """Example rigs to start from."""

    presets: list[PresetOut]
