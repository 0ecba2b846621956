"""Links by which clients accept inspections, and the forms that they fill in."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Literal, Self
from urllib.parse import parse_qsl

from pydantic import Field, StringConstraints, ValidationError, model_validator

from app.storage.records.acceptance import Answer, LinkView, SectionView
from app.survey.given import LINE, TEXT, Given
from app.survey.observations.acceptance import (
    MOST_DAYS,
    MOST_SECTIONS,
    USUAL_DAYS,
    AnswerKind,
    Standing,
)
from app.web.deps import OBSERVATION_ID
from app.web.schemas.library.bulk import InspectionRef
from app.web.schemas.out import Out

_MOST_FIELDS = 8


class LinkIn(Given):
    """A link to make."""

    inspections: list[InspectionRef] = Field(
        min_length=1, max_length=MOST_SECTIONS, description="Ids, in the order of the page."
    )
    note: Annotated[str, StringConstraints(strip_whitespace=True, max_length=200, pattern=LINE)] = (
        Field("", description="For whom or what it is; the client sees it.")
    )
    days: Annotated[int, Field(ge=1, le=MOST_DAYS)] = USUAL_DAYS


class SectionOut(Out):
    """An inspection that a link shows."""

    place: int
    inspection_id: str
    name: str
    """When the link was made."""
    is_deleted: bool
    is_changed: bool
    """Since the link was made."""
    standing: Standing
    answers: int

    @classmethod
    def of(cls, section: SectionView) -> Self:
        """Convert the service's view."""
        return cls.read_from(section, answers=len(section.answers))


class LinkOut(Out):
    """A link without its secret."""

    id: str
    note: str
    state: Literal["valid", "expired", "revoked"]
    made_at: datetime
    made_by: str
    expires_at: datetime
    revoked_at: datetime | None
    revoked_by: str | None
    opened: int
    """How often its page was opened."""
    opened_at: datetime | None
    sections: list[SectionOut]

    @classmethod
    def of(cls, link: LinkView) -> Self:
        """Convert the service's view."""
        row = link.row
        is_over = row.expires_at <= datetime.now(UTC)
        state = "revoked" if row.revoked_at else "expired" if is_over else "valid"
        sections = [SectionOut.of(section) for section in link.sections]
        return cls.read_from(row, state=state, sections=sections)


class LinksOut(Out):
    """The newest links."""

    links: list[LinkOut]


class LinkMadeOut(Out):
    """A link that was just made."""

    link: LinkOut
    path: str
    """Of its page on this server; shown this once, because its secret is stored nowhere."""


class AnswerIn(Given):
    """What a client says about a section."""

    id: Annotated[str, Field(pattern=OBSERVATION_ID)]
    version: Annotated[str, Field(pattern=r"^[0-9.]{1,40}$")]
    kind: AnswerKind
    person: Annotated[
        str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100, pattern=LINE)
    ]
    text: Annotated[str, StringConstraints(strip_whitespace=True, max_length=4000, pattern=TEXT)]

    @model_validator(mode="after")
    def _asks_something(self) -> Self:
        if self.kind == "question" and not self.text:
            raise ValueError("no_text")
        return self

    @classmethod
    def read(cls, form: dict[str, str]) -> tuple[Answer | None, str]:
        """Return what the fields of a form say; or else the key of the sentence about a fault."""
        try:
            return Answer(**cls.model_validate(form).model_dump()), ""
        except ValidationError as error:
            fault = error.errors()[0]
            if fault["loc"] == ("person",):
                return None, "no_person"
            if fault["loc"] == ("text",):
                return None, "long_text"
            return None, "no_text" if "no_text" in fault["msg"] else "bad_form"


def fields_of(body: bytes) -> dict[str, str]:
    """Return the fields of a form; none of one that is damaged."""
    try:
        pairs = parse_qsl(body.decode(), keep_blank_values=True, max_num_fields=_MOST_FIELDS)
    except ValueError:
        return {}
    return {name: value.replace("\r\n", "\n") for name, value in pairs}
