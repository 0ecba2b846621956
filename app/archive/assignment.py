"""What each film gets by the rules and tables: the first rule that fits, and what a table states
of the film, which takes precedence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.archive.paths import title_of
from app.archive.rules import Rule, Rules, Stated, checked_rig, said_by
from app.archive.tables import Table
from app.errors import code_of
from vo_core.errors import InvalidRig


@dataclass(frozen=True)
class Assigned:
    """What a film gets, named as the columns of the archive."""

    name: str
    project: str | None
    asset: str | None
    rule: str | None
    rig_name: str | None
    rig: Mapping[str, Any] | None
    """None if there is none that can be used."""
    header: Mapping[str, Any]
    priority: int
    error_code: str | None
    """Why it cannot be tracked, or what is wrong with its header, like the next."""
    error_detail: str | None


_Fault = tuple[str, str]
"""Code and sentence."""


class Assignment:
    """Applies one set of rules to any number of films; each rig is checked once."""

    def __init__(self, rules: Rules) -> None:
        self._rules = rules
        self._rigs: dict[str, tuple[Mapping[str, Any] | None, _Fault | None]] = {}

    def assigned_to(
        self,
        path: str,
        relative: str,
        tables: Sequence[Table] = (),
        priority: int | None = None,
    ) -> Assigned:
        """Return what a film gets.

        Args:
            path, relative: Text of its whole path, and of its path within the added folder.
            tables: Of several that state the same, the first counts.
            priority: Of all films that are being added; None leaves it to the rule.
        """
        rule, fields = self._fitting(relative)
        said, fault = (Stated(), None) if rule is None else said_by(rule, fields)
        if priority is not None:
            said = Stated(priority=priority).over(said)
        for table in reversed(tables):
            said = table.stated_of(path, relative, said.asset).over(said)
        header = dict(said.header)
        in_header = {name: header.pop(name, None) for name in ("project", "asset_id")}
        rig, rig_fault = (None, _without_rig(rule)) if said.rig is None else self._rig(said.rig)
        code, detail = rig_fault or (("invalid_header", fault) if fault else (None, None))
        return Assigned(
            name=said.name or title_of(relative),
            project=said.project or in_header["project"],
            asset=said.asset or in_header["asset_id"],
            rule=rule.name if rule else None,
            rig_name=said.rig,
            rig=rig,
            header=header,
            priority=said.priority or 0,
            error_code=code,
            error_detail=detail,
        )

    def _fitting(self, relative: str) -> tuple[Rule | None, Mapping[str, str]]:
        for rule in self._rules.rules:
            fields = rule.compiled.match(relative)
            if fields is not None:
                return rule, fields
        return None, {}

    def _rig(self, name: str) -> tuple[Mapping[str, Any] | None, _Fault | None]:
        if name not in self._rigs:
            self._rigs[name] = _checked(name, self._rules.rigs)
        return self._rigs[name]


def _checked(name: str, rigs: Mapping[str, Any]) -> tuple[Mapping[str, Any] | None, _Fault | None]:
    if name not in rigs:
        return None, ("rig_missing", f"There is no rig {name!r}.")
    try:
        return checked_rig(rigs[name], f"The rig {name}"), None
    except InvalidRig as error:
        return None, (code_of(InvalidRig), str(error))


def _without_rig(rule: Rule | None) -> _Fault:
    if rule is None:
        return "no_rule", "No rule fits this film, so it has no rig."
    return "no_rig", f"The rule {rule.name!r} gives no rig."
