"""The template of a project's reports: texts, colour, sections, grades and recommendations.

It is stored as JSON (`tables.ReportTemplateRow`). Every field has a default, so that a
stored template stays valid when fields are added.
"""

from __future__ import annotations

import base64
import binascii
from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, field_validator

from app.survey.given import LINE, TEXT, CodeName, Given, Letter
from app.survey.observations.tag import Severity

Section = Literal[
    "summary", "header", "graphic", "observations", "photos", "wall", "scene", "condition",
    "measurement", "checks",
]  # fmt: skip
"""Parts of a report after its cover; `scene` is in the HTML only."""
SECTIONS: tuple[Section, ...] = (
    "summary", "header", "graphic", "observations", "photos", "wall", "scene", "condition",
    "measurement", "checks",
)  # fmt: skip
GradeRule = Literal["own", "structural", "none"]
"""The rule by which an asset is graded; see `app.reports.content.grades`."""

MOST_LOGO_BYTES = 200_000
_Paragraphs = Annotated[str, StringConstraints(max_length=4000, pattern=TEXT)]
_Line = Annotated[str, StringConstraints(max_length=200, pattern=LINE)]


_LEAST_CONTRAST = 4.5
"""Of text on its ground, WCAG 2.2, 1.4.3."""


def contrast_on_white(colour: str) -> float:
    """Return the contrast of a colour such as #1d3b50 on white paper, 1 to 21 (WCAG 2.2)."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
    shares = ((0.2126, red), (0.7152, green), (0.0722, blue))
    light = sum(share * _linear(part) for share, part in shares)
    return 1.05 / (light + 0.05)


def _linear(part: float) -> float:
    return part / 12.92 if part <= 0.04045 else float(((part + 0.055) / 1.055) ** 2.4)


class Recommendation(Given):
    """A block of text that is proposed for a code."""

    text: Annotated[str, StringConstraints(min_length=1, max_length=1000, pattern=TEXT)]
    code: CodeName | None = Field(default=None, description="null: for every code.")
    char1: Letter | None = None
    severity_from: Severity = Field(default=0, description="Only for defects at least as severe.")
    cost: Annotated[float, Field(ge=0, le=1e9)] | None = Field(
        default=None, description="Of one defect."
    )


class ReportTemplate(Given):
    """How the reports of a project look; the default is the report without any choice."""

    company_name: _Line = Field(default="", description="Empty: the company of the server.")
    company_address: _Paragraphs = ""
    logo: str = Field(
        default="", description="PNG or JPEG in base64; empty: the logo of the server."
    )
    introduction: _Paragraphs = Field(default="", description="Printed on the cover.")
    closing: _Paragraphs = Field(default="", description="Printed above the signatures.")
    accent: Annotated[str, StringConstraints(pattern=r"^#[0-9a-f]{6}$")] = "#1d3b50"
    sections: list[Section] = Field(default_factory=lambda: list(SECTIONS))
    grade: GradeRule = "own"
    recommendations: list[Recommendation] = Field(default_factory=list, max_length=500)
    costs: bool = Field(default=False, description="Whether reports have a column of costs.")
    currency: Annotated[str, StringConstraints(max_length=8, pattern=LINE)] = "EUR"

    @field_validator("sections")
    @classmethod
    def _once(cls, sections: list[Section]) -> list[Section]:
        if len(set(sections)) != len(sections):
            raise ValueError("names a section twice")
        return sections

    @field_validator("accent")
    @classmethod
    def _legible(cls, accent: str) -> str:
        if contrast_on_white(accent) < _LEAST_CONTRAST:
            raise ValueError("is too light: titles in this colour cannot be read on white")
        return accent

    @field_validator("logo")
    @classmethod
    def _small(cls, logo: str) -> str:
        try:
            content = base64.b64decode(logo, validate=True)
        except (binascii.Error, ValueError) as error:
            raise ValueError("is not base64") from error
        if len(content) > MOST_LOGO_BYTES:
            raise ValueError(f"has more than {MOST_LOGO_BYTES} bytes")
        return logo

    @classmethod
    def kept(cls, content: dict[str, object]) -> Self:
        """Return a stored template; what an older version cannot know has its default."""
        known = {name: content[name] for name in cls.model_fields if name in content}
        return cls.model_validate(known)


DEFAULT_TEMPLATE = ReportTemplate()
