"""The logged-in person and their choices for the page."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, Field, StringConstraints, field_validator

from app.access.access import fault_of_name
from app.reports.content.words import Language
from app.storage.folder.tokens import Role
from app.survey.given import CodeName, Given, Name, PackId
from app.survey.observations.tag import Coded
from app.web.schemas.out import Out

RoleName = Literal["viewer", "operator", "admin"]


class LoginIn(Given):
    """The access token, exchanged for a session cookie."""

    token: Annotated[str, Field(min_length=1, max_length=500)]


class SessionOut(BaseModel):
    """Who is logged in."""

    name: str
    role: str


class RoleIn(Given):
    """The role of a token."""

    role: RoleName

    def to_role(self) -> Role:
        """Convert to the stored form."""
        return Role(self.role)


class TokenIn(RoleIn):
    """A token to be made."""

    name: str = Field(description="User of the token, as shown in the history.")
    projects: Annotated[list[Name], Field(min_length=1, max_length=100)] | None = Field(
        None, description="The only projects that it sees and changes; null: all of them."
    )

    @field_validator("name")
    @classmethod
    def _may_be_taken(cls, name: str) -> str:
        if fault := fault_of_name(name):
            raise ValueError(fault)
        return name

    def to_projects(self) -> frozenset[str] | None:
        """Convert to the stored form."""
        return None if self.projects is None else frozenset(self.projects)


class TokenMadeOut(BaseModel):
    """A token that was just made."""

    secret: str
    """Shown this once: it is stored nowhere."""


class TokenOut(Out):
    """A token without its secret."""

    name: str
    role: RoleName
    created_at: datetime | None
    """None for the server's own token."""
    revoked_at: datetime | None
    seen_at: datetime | None
    """Last use, precise to some minutes."""
    sessions: int
    """Browsers that are logged in with it."""
    projects: list[str] | None
    """The only projects that it sees and changes, by name; null: all of them."""
    is_server: bool
    """Whether it is the server's own token, which cannot be changed here."""

    @field_validator("projects", mode="before")
    @classmethod
    def _sorted(cls, projects: frozenset[str] | None) -> list[str] | None:
        return None if projects is None else sorted(projects)


class TokensOut(BaseModel):
    """The server's own token, then the others in the order of creation."""

    tokens: list[TokenOut]


class QuickCode(Coded):
    """What a digit key or a template tags: a code, with what else is given to each tag of it."""

    code: CodeName


KeyName = Annotated[str, StringConstraints(min_length=1, max_length=30)]
"""A key of the page, as a browser names it, with `Shift+` or `Ctrl+` before it where needed."""


class PreferencesIn(Given):
    """All choices of a person for the page."""

    language: Language | None = Field(description="null: the language of the browser.")
    units: Literal["m", "ft"]
    quick_codes: Annotated[list[QuickCode], Field(max_length=9)] = Field(
        description="Codes of the keys 1 to 9, in this order."
    )
    single_keys: bool = Field(
        default=True, description="Whether letters, digits and signs are shortcuts (WCAG 2.1.4)."
    )
    keys: Annotated[dict[KeyName, KeyName], Field(max_length=100)] = Field(
        default_factory=dict, description="Other keys, by the usual one, for what it does."
    )
    templates: Annotated[list[QuickCode], Field(max_length=26)] = Field(
        default_factory=list, description="More codes with their details, for a list of the page."
    )
    pack: PackId | None = Field(description="Code pack of new inspections; null: the built-in one.")


class MeOut(BaseModel):
    """Who is logged in, and their choices."""

    name: str
    role: str
    preferences: PreferencesIn
