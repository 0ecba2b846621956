"""The tags of the document (PDF/UA-1): what a program reads aloud, in its order.

Every piece of a page is either the content of an element of this tree or an artifact: a rule, a
ground, a head or a foot. An element is written as soon as it is closed, as a report of a hundred
inspections has some hundred thousand.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from app.reports.pdf.file import File, dictionary, reference

Kind = Literal[
    "Document", "Part", "Sect", "H1", "H2", "H3", "H4", "H5", "H6", "P", "Table", "TR", "TH", "TD",
    "Figure", "Link", "TOC", "TOCI", "Lbl", "Reference",
]  # fmt: skip
Scope = Literal["Column", "Row"]

DEEPEST = 6
"""Headings go from H1 to H6."""


class Element:
    """An element that is still open."""

    __slots__ = ("entries", "kids", "kind", "number", "page")

    def __init__(self, kind: Kind, number: int, entries: dict[str, object]) -> None:
        self.kind = kind
        self.number = number
        self.entries = entries
        self.kids: list[bytes] = []
        self.page: int | None = None
        """Page of its first content."""


class Tags:
    """The tree of a document."""

    def __init__(self, file: File) -> None:
        self._file = file
        self._root = file.take()
        self._parents: list[array[int] | int] = []
        """By key: the elements of a page by the numbers of their contents, or of one annotation."""
        self._page: tuple[int, array[int]] | None = None
        """Key and elements of the present page."""
        self._document = self._made("Document", self._root)
        self._open = [self._document]
        """The innermost section is the last."""

    def _made(self, kind: Kind, parent: int, **entries: object) -> Element:
        return Element(kind, self._file.take(), {**entries, "P": reference(parent)})

    def open(self, kind: Kind, parent: Element | None = None, **entries: object) -> Element:
        """Begin an element at the end of another, or of the innermost section.

        Args:
            kind: Its structure type.
            parent: An open element.
            entries: Formatted values of its dictionary, such as `Alt`.
        """
        parent = parent or self._open[-1]
        element = self._made(kind, parent.number, **entries)
        parent.kids.append(reference(element.number))
        return element

    def close(self, element: Element) -> None:
        """Write an element whose contents are complete."""
        entries: dict[str, object] = {"S": f"/{element.kind}", **element.entries}
        if element.page is not None:
            entries["Pg"] = reference(element.page)
        if element.kids:
            entries["K"] = b"[%s]" % b" ".join(element.kids)
        self._file.put(element.number, dictionary(entries))

    @contextmanager
    def element(
        self, kind: Kind, parent: Element | None = None, **entries: object
    ) -> Iterator[Element]:
        """Open an element for as long as it is drawn."""
        element = self.open(kind, parent, **entries)
        yield element
        self.close(element)

    def begin_section(self, level: int, kind: Kind = "Sect") -> None:
        """End the sections at this level or below, and begin one there; the highest level is 0."""
        self.end_sections(level)
        self._open.append(self.open(kind))

    def end_sections(self, level: int = 0) -> None:
        """End the sections at this level or below."""
        while len(self._open) > level + 1:
            self.close(self._open.pop())

    @property
    def page(self) -> tuple[int, array[int]]:
        """The key under which the present page finds its elements, and these."""
        if self._page is None:
            self._page = len(self._parents), array("L")
            self._parents.append(self._page[1])
        return self._page

    def end_page(self) -> None:
        """Begin the numbers of contents anew."""
        self._page = None

    def content_of(self, element: Element) -> int:
        """Return the number of the next content of the page, which is the element's."""
        (_, elements), page = self.page, self._file.page
        number = len(elements)
        elements.append(element.number)
        if element.page is None:
            element.page = page
        element.kids.append(
            b"%d" % number
            if page == element.page
            else b"<</Type/MCR/Pg %s/MCID %d>>" % (reference(page), number)
        )
        return number

    def annotation_of(self, element: Element, annotation: int) -> int:
        """Add an annotation to an element; return the key by which it finds the element."""
        key = len(self._parents)
        self._parents.append(element.number)
        page = reference(self._file.page)
        element.kids.append(b"<</Type/OBJR/Obj %s/Pg %s>>" % (reference(annotation), page))
        return key

    def finish(self) -> int:
        """Close and write the whole tree; return the number of its root."""
        self.end_sections()
        self.close(self._document)
        rows = b" ".join(
            b"%d %s" % (key, reference(found) if isinstance(found, int) else
                        b"[%s]" % b" ".join(map(reference, found)))
            for key, found in enumerate(self._parents)
        )  # fmt: skip
        parents = self._file.take()
        self._file.put(parents, b"<</Nums [%s]>>" % rows)
        self._file.put(self._root, dictionary({
            "Type": "/StructTreeRoot", "K": b"[%s]" % reference(self._document.number),
            "ParentTree": reference(parents), "ParentTreeNextKey": len(self._parents),
        }))  # fmt: skip
        return self._root
