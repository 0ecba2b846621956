"""Parses XML of other programs: elements with their lines, and nothing that a file can define.

A document type is refused as a whole, so there are no entities, no external files and no defaults.
Names come without namespaces, which differ between versions of the formats.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from app.errors import InvalidImport
from app.imports.surveys.letters import decoded
from app.imports.surveys.survey import Caveat, Notes

_MOST_ELEMENTS = 1_000_000
"""20 000 observations of 25 elements have half as many; each takes some 200 bytes."""
_MOST_ATTRIBUTES = 100_000
_DEEPEST = 64
_LONGEST_TEXT = 100_000
"""Characters of one element; the rest is dropped."""
_GUESSED = ("", "utf-8", "utf8", "us-ascii", "ascii")
"""Encodings that programs name without keeping to them."""
_LONGEST_NAMES = 600
_NAMESPACE_END = "}"
_ENCODING = re.compile(rb"""\s*<\?xml[^>]{0,80}?encoding\s*=\s*["']([ -~]{0,40}?)["']""")


@dataclass(slots=True)
class Element:
    """An element of the file."""

    name: str
    """Without its namespace."""
    line: int
    attributes: dict[str, str]
    text: str = ""
    """Its own text, before and between the children."""
    children: list[Element] = field(default_factory=list)
    is_read: bool = False
    """Whether a reader has asked for its text."""

    def all(self, *names: str) -> Iterator[Element]:
        """Yield the elements at a path below this one."""
        if not names:
            yield self
            return
        for child in self.children:
            if child.name == names[0]:
                yield from child.all(*names[1:])

    def first(self, *names: str) -> Element | None:
        """Return the first element at a path, or None."""
        return next(self.all(*names), None)

    def value(self, *names: str) -> str:
        """Return the text at a path on one line; empty if there is none."""
        found = self.first(*names)
        return found.own_text() if found else ""

    def own_text(self) -> str:
        """Return its own text on one line, which is read by that."""
        self.is_read = True
        return " ".join(self.text.split())

    def filled(self, apart: Collection[str]) -> Iterator[Element]:
        """Yield the elements below it that hold a text, without those of these names."""
        for child in self.children:
            if child.name not in apart:
                if child.text.strip():
                    yield child
                yield from child.filled(apart)


NOTHING = Element("", 0, {})
"""Stands for an element that a file does not have."""


def first_rows(rows: Iterable[Element], room: int, notes: Notes) -> list[Element]:
    """Return as many rows as are read, and warn of the others."""
    found = list(rows)
    if len(found) > room:
        notes.add_too_many(found[room].line)
    return found[:room]


def note_unread(notes: Notes, *parents: Element, apart: Collection[str] = ()) -> None:
    """Warn of what nobody has read, by the names of the elements.

    Args:
        notes: For the warning.
        parents: Where they are.
        apart: Names of those that state nothing of their own.
    """
    filled = [each for parent in parents for each in parent.filled(apart)]
    known = {(each.name, each.text) for each in filled if each.is_read}
    names = {each.name for each in filled if (each.name, each.text) not in known}
    if names:
        notes.add("not_read", names=", ".join(sorted(names))[:_LONGEST_NAMES])


def unknown_parts(parent: Element, known: Collection[str]) -> list[Caveat]:
    """Return the warning that names parts of a file of which nothing is known."""
    names = sorted({child.name for child in parent.children if child.name not in known})
    named = ", ".join(names)[:_LONGEST_NAMES]
    return [Caveat("not_read", values={"names": named})] if names else []


def looks_like(content: bytes) -> bool:
    """Return whether the content begins like XML."""
    return decoded(content[:256], "")[0].lstrip().startswith("<")


def parsed(content: bytes) -> tuple[Element, tuple[Caveat, ...]]:
    """Return the root, and warnings where letters may be wrong.

    Raises:
        InvalidImport: The file is not well formed, defines entities, or is too deep or too large;
        the text says where.
    """
    named = _ENCODING.match(content)
    encoding = named[1].decode("ascii") if named else ""
    text, said = decoded(content, encoding)
    if any(each.key == "letters_assumed" for each in said) and encoding.lower() not in _GUESSED:
        raise InvalidImport(
            f"The letters of the XML file cannot be read: the encoding {encoding!r} is not known. "
            "Export it again in UTF-8."
        )
    try:
        return _Builder().build(text), said
    except expat.ExpatError as error:
        raise InvalidImport(
            f"The file is not well-formed XML: {expat.ErrorString(error.code)} in line "
            f"{error.lineno}, column {error.offset + 1}."
        ) from error
    except UnicodeEncodeError as error:
        raise InvalidImport(f"The letters of the XML file cannot be read: {error}.") from error


class _Builder:
    def __init__(self) -> None:
        self._parser = expat.ParserCreate(None, _NAMESPACE_END)
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text
        self._parser.StartDoctypeDeclHandler = self._refuse_definitions
        self._parser.EntityDeclHandler = self._refuse_definitions
        self._parser.ExternalEntityRefHandler = self._refuse_definitions
        self._open = [Element("", 0, {})]
        """The elements that are open, the root within one that stands for the file."""
        self._elements = self._attributes = 0

    def build(self, text: str) -> Element:
        """Return the root."""
        self._parser.Parse(text, True)
        return self._open[0].children[0]

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._elements += 1
        self._attributes += len(attributes)
        if self._elements > _MOST_ELEMENTS or self._attributes > _MOST_ATTRIBUTES:
            raise InvalidImport("The file has more elements than surveys do. Export it in parts.")
        line = self._parser.CurrentLineNumber
        if len(self._open) > _DEEPEST:
            raise InvalidImport(f"Line {line} of the file is nested too deeply.")
        own = {_local(key): value for key, value in attributes.items()}
        element = Element(_local(name), line, own)
        self._open[-1].children.append(element)
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _text(self, text: str) -> None:
        if len(self._open[-1].text) < _LONGEST_TEXT:
            self._open[-1].text += text

    def _refuse_definitions(self, *_: Any) -> int:
        raise InvalidImport(
            f"Line {self._parser.CurrentLineNumber}: the file defines a document type or entities. "
            "No such format needs them, and they can do harm; remove them, or export the file "
            "again."
        )


def _local(name: str) -> str:
    return name.rpartition(_NAMESPACE_END)[2]
