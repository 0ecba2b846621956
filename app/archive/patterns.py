"""Patterns of paths: globs whose named fields hold parts of the path.

`*` is any text within the name of one folder or file, `?` one character, `{field}` any text but an
empty one, and `**` as a whole name is any number of folders (at the end: all that is below).  Case
does not matter: `*.mp4` fits `A.MP4`.

No pattern makes the search long: within one name each wildcard takes as little as it can and never
takes more later (an atomic group), because what follows it is fixed text up to the next wildcard,
and taking more of the name would only leave less for the rest.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

_TOKEN = re.compile(r"\{(?P<field>[^{}]*)\}|(?P<any>\*)|(?P<one>\?)|(?P<text>[^{}*?]+)|(?P<odd>.)")
_FIELD = re.compile(r"[a-z][a-z0-9_]{0,49}")
_ANY_FOLDERS = "**"


class InvalidPattern(ValueError):
    """The text is not a pattern; the message says why."""


@dataclass(frozen=True)
class Pattern:
    """A compiled pattern."""

    segments: tuple[re.Pattern[str] | None, ...]
    """One for each name of a path; None is any number of folders."""
    fields: tuple[str, ...]
    """Names of the fields, in their order."""

    def match(self, path: str) -> dict[str, str] | None:
        """Return the fields of a relative path with slashes; None if the pattern does not fit."""
        names = path.split("/")
        tried: set[tuple[int, int]] = set()
        waiting: list[tuple[int, int, dict[str, str]]] = [(0, 0, {})]
        # Without recursion: a path may have two thousand names.
        while waiting:
            at, first, fields = waiting.pop()
            if at == len(self.segments) or first == len(names):
                if (at, first) == (len(self.segments), len(names)):
                    return fields
                continue
            if (at, first) in tried:  # it did not fit
                continue
            tried.add((at, first))
            segment = self.segments[at]
            if segment is not None:
                if hit := segment.fullmatch(names[first]):
                    waiting.append((at + 1, first + 1, fields | hit.groupdict()))
            elif at == len(self.segments) - 1:
                return fields
            else:  # the last one is tried first: as few folders as possible
                waiting.append((at, first + 1, fields))
                waiting.append((at + 1, first, fields))
        return None


def compiled(text: str) -> Pattern:
    """Compile a pattern.

    Raises:
        InvalidPattern: The message says what is wrong.
    """
    names = text.split("/")
    if "" in names:
        raise InvalidPattern("it begins or ends with a slash, or has two in a row")
    fields: list[str] = []
    segments = tuple(None if name == _ANY_FOLDERS else _segment(name, fields) for name in names)
    twice = next((field for field in fields if fields.count(field) > 1), None)
    if twice is not None:
        raise InvalidPattern(f"the field {{{twice}}} occurs twice")
    return Pattern(segments, tuple(fields))


def _segment(name: str, fields: list[str]) -> re.Pattern[str]:
    """Compile the pattern of one name; add its fields."""
    head, wildcards = "", list[tuple[str, str]]()
    """Fixed text before the first wildcard; each wildcard with the fixed text after it."""
    for token in _TOKEN.finditer(name):
        if token["odd"]:
            raise InvalidPattern(f"the brace {token['odd']} has no partner")
        if token["text"] or token["one"]:
            fixed = "." if token["one"] else re.escape(token["text"])
            if wildcards:
                wildcard, before = wildcards[-1]
                wildcards[-1] = wildcard, before + fixed
            else:
                head += fixed
            continue
        if wildcards and not wildcards[-1][1]:
            if token["any"] and wildcards[-1][0] == "":
                raise InvalidPattern("** stands for folders only as a whole name, as in **/*.mp4")
            raise InvalidPattern("between a field and the next field or * there must be some text")
        if not token["any"] and not _FIELD.fullmatch(token["field"]):
            raise InvalidPattern(
                f"the field {{{token['field']}}} is not named in lower-case letters, digits and _"
            )
        if not token["any"]:
            fields.append(token["field"])
        wildcards.append((token["field"] or "", ""))
    return re.compile(head + _wildcards(wildcards), re.IGNORECASE | re.DOTALL)


def _wildcards(wildcards: Sequence[tuple[str, str]]) -> str:
    """Return the expression of wildcards and the fixed texts after them; the last one reaches as
    far as it must.
    """
    if not wildcards:
        return ""
    *inner, last = wildcards
    lazy = "".join(
        f"(?>(?P<{field}>.+?){after})" if field else f"(?>.*?{after})" for field, after in inner
    )
    field, after = last
    return lazy + (f"(?P<{field}>.+){after}" if field else f".*{after}")
