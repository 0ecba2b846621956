"""Parses XML of other programs: elements with their lines, and nothing that a file can define.

A document type is refused as a whole, so there are no entities, no external files and no defaults.
Names come without namespaces, which differ between versions of the formats.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from app.errors import InvalidImport

_MOST_ELEMENTS = 1_000_000
"""20 000 observations of 25 elements have half as many; each takes some 200 bytes."""
_MOST_ATTRIBUTES = 100_000
_DEEPEST = 64
_LONGEST_TEXT = 100_000
"""Characters of one element; the rest is dropped."""
_NAMESPACE_END = "}"
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


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
        return " ".join(found.text.split()) if found else ""

    def values(self) -> dict[str, str]:
        """Return the texts of the children without children, by name; the first one counts."""
        found: dict[str, str] = {}
        for child in self.children:
            if not child.children and (text := " ".join(child.text.split())):
                found.setdefault(child.name, text)
        return found


NOTHING = Element("", 0, {})
"""Stands for an element that a file does not have."""


def looks_like(content: bytes) -> bool:
    """Return whether the content begins like XML."""
    head = content[:256].replace(b"\0", b"").removeprefix(b"\xef\xbb\xbf")
    return head.removeprefix(_UTF_16[0]).removeprefix(_UTF_16[1]).lstrip().startswith(b"<")


def parsed(content: bytes) -> Element:
    """Return the root.

    Raises:
        InvalidImport: The file is not well formed, defines entities, or is too deep or too large;
        the text says where.
    """
    builder = _Builder()
    parser = expat.ParserCreate(_encoding(content), _NAMESPACE_END)
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.text
    parser.StartDoctypeDeclHandler = builder.refuse_definitions
    parser.EntityDeclHandler = builder.refuse_definitions
    parser.ExternalEntityRefHandler = builder.refuse_definitions

    def line() -> int:
        return parser.CurrentLineNumber

    builder.line_of = line
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise InvalidImport(
            f"The file is not well-formed XML: {expat.ErrorString(error.code)} in line "
            f"{error.lineno}, column {error.offset + 1}."
        ) from error
    except (LookupError, ValueError) as error:
        raise InvalidImport(f"The letters of the XML file cannot be read: {error}.") from error
    assert builder.root is not None  # noqa: S101  (expat refuses a file without a root)
    return builder.root


def _encoding(content: bytes) -> str | None:
    """Return UTF-8 where the bytes are valid in it, whatever the file declares; else None for what
    it declares, or Latin letters of one byte each if it declares UTF-8.
    """
    if content.startswith(_UTF_16):
        return None
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        declared = content[:200].partition(b"?>")[0].lower()
        is_utf_8 = b"encoding" not in declared or b"utf-8" in declared
        return "iso-8859-1" if is_utf_8 else None
    return None if b"\0" in content[:4] else "utf-8"


class _Builder:
    """Builds the tree from what the parser meets."""

    def __init__(self) -> None:
        self.root: Element | None = None
        self.line_of: Callable[[], int] = lambda: 0
        self._open: list[Element] = []
        self._elements = self._attributes = 0

    def start(self, name: str, attributes: dict[str, str]) -> None:
        self._elements += 1
        self._attributes += len(attributes)
        if self._elements > _MOST_ELEMENTS or self._attributes > _MOST_ATTRIBUTES:
            raise InvalidImport("The file has more elements than surveys do. Export it in parts.")
        if len(self._open) == _DEEPEST:
            raise InvalidImport(f"Line {self.line_of()} of the file is nested too deeply.")
        own = {_local(key): value for key, value in attributes.items()}
        element = Element(_local(name), self.line_of(), own)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def end(self, _: str) -> None:
        self._open.pop()

    def text(self, text: str) -> None:
        if len(self._open[-1].text) < _LONGEST_TEXT:
            self._open[-1].text += text

    def refuse_definitions(self, *_: Any) -> int:
        raise InvalidImport(
            f"Line {self.line_of()}: the file defines a document type or entities. No such format "
            "needs them, and they can do harm; remove them, or export the file again."
        )


def _local(name: str) -> str:
    return name.rpartition(_NAMESPACE_END)[2]
