"""Rules that give the films of a folder their rig, project, asset, name and header."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, Self

from pydantic import Field, StringConstraints, field_validator, model_validator

from app.archive.paths import line_of
from app.archive.patterns import InvalidPattern, Pattern, compiled
from app.survey.fields.header import FIELDS
from app.survey.fields.values import InvalidValue, value_of
from app.survey.given import LINE, Given, Header
from vo_core import Rig
from vo_core.errors import InvalidRig
from vo_core.geometry.rectify import require_wall_in_view

MOST_PRIORITY = 9
"""Films of the archive come after those of the desk, whose priority is 10."""
_TEMPLATE_FIELD = re.compile(r"\{([^{}]*)\}")
_OWN_FIELDS = ("project", "asset", "name")
_HEADER_FIELDS = frozenset(known.name for known in FIELDS)

Line = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200, pattern=LINE)
]
RuleName = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100, pattern=LINE)
]
PatternText = Annotated[str, StringConstraints(min_length=1, max_length=1000, pattern=LINE)]
Priority = Annotated[int, Field(ge=-MOST_PRIORITY, le=MOST_PRIORITY)]


class Rule(Given):
    """What the films get whose path a pattern fits."""

    name: RuleName
    pattern: PatternText = Field(
        description="Glob of the path within the added folder: `*`, `?`, `**` for any folders, and "
        "fields such as `{project}/{asset}_*.mp4`."
    )
    rig: Line | None = Field(None, description="Name of a rig in `rigs`.")
    project: Line | None = Field(None, description="May contain fields of the pattern.")
    asset: Line | None = Field(None, description="May contain fields of the pattern.")
    name_of_film: Line | None = Field(None, description="May contain fields of the pattern.")
    header: Header = Field(default_factory=dict)
    priority: Priority = 0

    @field_validator("pattern")
    @classmethod
    def _compiles(cls, text: str) -> str:
        try:
            compiled(text)
        except InvalidPattern as error:
            raise ValueError(f"the pattern cannot be used: {error}") from error
        return text

    @model_validator(mode="after")
    def _fields_are_known(self) -> Self:
        templates = (self.project, self.asset, self.name_of_film)
        used = {name for text in templates for name in _TEMPLATE_FIELD.findall(text or "")}
        if unknown := sorted(used - set(self.compiled.fields)):
            raise ValueError(f"the pattern has no field {{{unknown[0]}}}, which the rule uses")
        idle = set(self.compiled.fields) - used - _HEADER_FIELDS - {*_OWN_FIELDS}
        if idle:
            raise ValueError(
                f"the field {{{min(idle)}}} of the pattern is neither project, asset, name nor a "
                "field of the header, and the rule does not use it"
            )
        return self

    @cached_property
    def compiled(self) -> Pattern:
        """The compiled pattern."""
        return compiled(self.pattern)


class Rules(Given):
    """Rigs by name, and the rules in their order: the first that fits a film wins."""

    rigs: dict[Line, dict[str, Any]] = Field(default_factory=dict, max_length=500)
    rules: list[Rule] = Field(default_factory=list, max_length=500)

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [rule.name for rule in self.rules]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"two rules are named {twice!r}")
        return self


@dataclass(frozen=True)
class Stated:
    """What a table says of a film, which takes precedence over a rule."""

    name: str | None = None
    project: str | None = None
    asset: str | None = None
    rig: str | None = None
    priority: int | None = None
    header: Mapping[str, Any] = field(default_factory=dict)

    def over(self, other: Stated) -> Stated:
        """Return both statements; this one takes precedence."""
        own = {name: value for name, value in vars(self).items() if value is not None}
        return replace(other, **own | {"header": {**other.header, **self.header}})


def require_usable(rules: Rules) -> None:
    """Check the rigs of rules that are to be stored.

    Raises:
        InvalidRig: A rule names a rig that is not there, or a rig cannot be used; the text names
            the place.
    """
    for name, rig in rules.rigs.items():
        checked_rig(rig, f"rigs.{name}")
    for number, rule in enumerate(rules.rules):
        if rule.rig is not None and rule.rig not in rules.rigs:
            raise InvalidRig(f"rules.{number}.rig: there is no rig {rule.rig!r} in rigs.")


def checked_rig(rig: object, origin: str) -> Mapping[str, Any]:
    """Return a rig as it is stored.

    Raises:
        InvalidRig: The text names field, value and the allowed values.
    """
    checked = Rig.parse(rig, origin=origin)
    require_wall_in_view(checked)
    return checked.model_dump(mode="json")


def said_by(rule: Rule, fields: Mapping[str, str]) -> tuple[Stated, str | None]:
    """Return what a rule and the fields of its pattern say, and a sentence about a field that does
    not fit the header and is left out.
    """
    header = dict(rule.header)
    problem = None
    for name in fields.keys() & _HEADER_FIELDS:
        try:
            header[name] = value_of(name, fields[name])
        except InvalidValue as error:
            problem = f"The path does not fit the header: {error}."
    return (
        Stated(
            name=_filled(rule.name_of_film, fields) or _legible(fields.get("name")),
            project=_filled(rule.project, fields) or _legible(fields.get("project")),
            asset=_filled(rule.asset, fields) or _legible(fields.get("asset")),
            rig=rule.rig,
            priority=rule.priority,
            header=header,
        ),
        problem,
    )


def _filled(template: str | None, fields: Mapping[str, str]) -> str | None:
    if template is None:
        return None
    return _legible(_TEMPLATE_FIELD.sub(lambda found: fields[found[1]], template))


def _legible(text: str | None) -> str | None:
    return None if text is None else line_of(text) or None
