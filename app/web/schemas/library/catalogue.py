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


class PackOut(Out):
    """An imported code pack."""

    id: str
    name: str
    codes: int
    created_at: datetime
    created_by: str

    @classmethod
    def of(cls, view: PackView) -> Self:
        """Convert the service's view."""
        return cls.read_from(view.row, codes=view.codes)


class PacksOut(BaseModel):
    """The imported code packs, sorted by name; the built-in one has no id and is not listed."""

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
