"""The logged-in person and their choices for the page."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from app.survey.given import Clock, CodeName, Given, Letter, PackId
from app.survey.tag import Quantity, Severity


class LoginIn(Given):
    """The access token, exchanged for a session cookie."""

    token: Annotated[str, Field(min_length=1, max_length=500)]


class SessionOut(BaseModel):
    """Who is logged in."""

    name: str
    role: str


class QuickCode(Given):
    """What a digit key tags: a code, with what else is given to each tag of it."""

    code: CodeName
    char1: Letter | None
    char2: Letter | None
    severity: Severity | None = None
    quant1: Quantity | None = None
    quant2: Quantity | None = None
    clock_from: Clock | None = None
    clock_to: Clock | None = None


class PreferencesIn(Given):
    """All choices of a person for the page."""

    language: Literal["en", "ms"] | None = Field(description="null: the language of the browser.")
    units: Literal["m", "ft"]
    quick_codes: Annotated[list[QuickCode], Field(max_length=9)] = Field(
        description="Codes of the keys 1 to 9, in this order."
    )
    single_keys: bool = Field(
        default=True, description="Whether letters, digits and signs are shortcuts (WCAG 2.1.4)."
    )
    pack: PackId | None = Field(description="Code pack of new inspections; null: the built-in one.")


class MeOut(BaseModel):
    """Who is logged in, and their choices."""

    name: str
    role: str
    preferences: PreferencesIn
