"""The pages that parts draw on: ReportLab's canvas with tags, links and places to link to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

from reportlab.lib.colors import Color
from reportlab.pdfgen.canvas import Canvas

from app.reports.content.fonts import LATIN, font_of
from app.reports.content.pictures import Jpeg
from app.reports.content.typesetting import one_line
from app.reports.pdf.file import File, dictionary, reference
from app.reports.pdf.styles import ACCENT, CELL, PAGE_HEIGHT, PAGE_WIDTH, Style
from app.reports.pdf.tags import DEEPEST, Element, Kind, Tags
from app.reports.pdf.text import draw

Rect = tuple[float, float, float, float]
"""Left, bottom, right, top."""
Artifact = Literal["Header", "Footer", "Layout"]

_PROPERTIES: dict[Artifact, str] = {
    "Header": "<</Type/Pagination/Subtype/Header>>",
    "Footer": "<</Type/Pagination/Subtype/Footer>>",
    "Layout": "<</Type/Layout>>",
}
_MOST_SAID = 8000
"""Characters of a sentence: PDF/A allows strings of 32,767 bytes."""
_FORM = (-60, -20, 60, 40)
"""Bounds of a form that holds a number of a page."""


class Paper(Canvas):
    """A canvas whose contents are all tagged or artifacts."""

    _doc: File
    _code: list[str]
    _formsinuse: list[str]
    _annotationrefs: list[bytes]

    def __init__(self, file: File) -> None:
        # It begins with an embedded font; otherwise every page would name one that is not.
        super().__init__(
            "", pagesize=(PAGE_WIDTH, PAGE_HEIGHT), pageCompression=1, invariant=1,
            initialFontName=font_of(LATIN, 400).fontName,  # type: ignore[arg-type]
        )  # fmt: skip
        self._doc = file
        self.tags = Tags(file)
        self.level = 0
        """Depth of the present report in the document."""
        self.key = ""
        """Sets the places of the present report apart from those of others."""
        self.accent: Color = ACCENT
        """What ACCENT stands for: the colour of the present report's template."""
        self._artifact: str | None = None
        self._bookmarks = 0
        self._places: dict[str, tuple[int, int, float, float]] = {}
        self._wanted: set[str] = set()
        """Places whose page is written somewhere."""
        self._linked: set[str] = set()

    def showPage(self) -> None:  # noqa: N802
        """End the page."""
        self._doc.parents_key, _ = self.tags.page
        super().showPage()
        self.tags.end_page()

    def setFillColor(self, aColor: Any, alpha: float | None = None) -> None:  # noqa: N802
        """Set the colour of areas and letters."""
        super().setFillColor(self._of_template(aColor), alpha)

    def setStrokeColor(self, aColor: Any, alpha: float | None = None) -> None:  # noqa: N802
        """Set the colour of lines."""
        super().setStrokeColor(self._of_template(aColor), alpha)

    def _of_template(self, colour: Any) -> Any:
        return self.accent if colour is ACCENT else colour

    @contextmanager
    def artifact(self, kind: Artifact = "Layout") -> Iterator[None]:
        """Draw what is not read aloud; what is tagged within is taken out of it."""
        self._artifact = f"/Artifact {_PROPERTIES[kind]} BDC"
        self._code.append(self._artifact)
        yield
        self._end_artifact()
        self._artifact = None

    def _end_artifact(self) -> None:
        if self._code[-1] == self._artifact:
            self._code.pop()  # it is empty
        else:
            self._code.append("EMC")

    @contextmanager
    def tagged(self, element: Element) -> Iterator[None]:
        """Draw content of an element."""
        if self._artifact:
            self._end_artifact()
        number = self.tags.content_of(element)
        self._code.append(f"/{element.kind} <</MCID {number}>> BDC")
        yield
        self._code.append("EMC")
        if self._artifact:
            self._code.append(self._artifact)

    @contextmanager
    def element(self, kind: Kind, parent: Element | None = None) -> Iterator[Element]:
        """Draw an element that has only this content."""
        with self.tags.element(kind, parent) as element, self.tagged(element):
            yield element

    @contextmanager
    def figure(self, alt: str, rect: Rect, parent: Element | None = None) -> Iterator[Element]:
        """Draw a picture within a rectangle, which a sentence describes."""
        box = " ".join(f"{value:.2f}" for value in self._absolute(rect))
        with (
            self.tags.element(
                "Figure", parent, Alt=self._said(alt),
                A=f"<</O/Layout/Placement/Block/BBox[{box}]>>",
            ) as element,
            self.tagged(element),
        ):  # fmt: skip
            yield element

    def _said(self, text: str) -> bytes:
        return self._doc.text(one_line(text)[:_MOST_SAID])

    def heading_kind(self, level: int) -> Kind:
        """Return the kind of a heading: 0 for the title of the present report."""
        return f"H{min(DEEPEST, 1 + self.level + level)}"  # type: ignore[return-value]

    def drawImage(  # type: ignore[override]  # noqa: N802
        self, jpeg: Jpeg, x: float, y: float, width: float, height: float
    ) -> None:
        """Draw a picture; the file has it once, wherever it is drawn."""
        name = self._doc.picture(jpeg)
        self.saveState()
        self.transform(width, 0, 0, height, x, y)
        self._code.append(f"/{self._doc.getXObjectName(name)} Do")
        self.restoreState()
        self._formsinuse.append(name)

    def place(self, name: str, x: float, y: float) -> None:
        """Name a place of the present report, to which links go."""
        left, top = self.absolutePosition(x, y)
        self._places[self._full(name)] = (self._doc.page, self.getPageNumber(), left, top)

    def bookmark(self, title: str, level: int, x: float, y: float) -> None:
        """Add a bookmark; 0 is the level of the parts of a report."""
        self._bookmarks += 1
        key = f"bookmark {self._bookmarks}"
        self.bookmarkHorizontal(key, x, y)
        self.addOutlineEntry(one_line(title), key, level + self.level, closed=self.level > 0)

    def link(self, name: str, contents: str, rect: Rect, element: Element) -> None:
        """Link a rectangle to a place of the present report, which may be named later."""
        self._linked.add(self._full(name))
        self._annotate(rect, contents, element, {"Dest": f"({self._full(name)})"})

    def link_out(self, uri: str, contents: str, rect: Rect, element: Element) -> None:
        """Link a rectangle to a file beside the document, or to an address."""
        action = b"<</S/URI/URI %s>>" % self._doc.text(uri)
        self._annotate(rect, contents, element, {"A": action})

    def _annotate(
        self, rect: Rect, contents: str, element: Element, target: dict[str, Any]
    ) -> None:
        number = self._doc.take()
        key = self.tags.annotation_of(element, number)
        corners = " ".join(f"{value:.2f}" for value in self._absolute(rect))
        self._doc.put(number, dictionary({
            "Type": "/Annot", "Subtype": "/Link", "Rect": f"[{corners}]", "Border": "[0 0 0]",
            "F": 4, "StructParent": key, "Contents": self._said(contents), **target,
        }))  # fmt: skip
        self._annotationrefs.append(reference(number))

    def page_of(self, name: str) -> None:
        """Draw the number of a place's page, right-aligned at the origin; it is filled in at the
        end.
        """
        self._wanted.add(self._full(name))
        self.doForm(_form_of(self._full(name)))

    def number(self, name: str, value: int, style: Style = CELL, align: str = "left") -> None:
        """Fill in a form that pages have drawn."""
        self.beginForm(name, *_FORM)
        draw(self, 0, 0, str(value), style, align)
        self.endForm()

    def finish(self) -> dict[str, object]:
        """Fill in the numbers of pages; return the entries of the catalogue for places and tags.

        Raises:
            ValueError: A link goes to a place that no part has named.
        """
        if missing := (self._linked | self._wanted) - set(self._places):
            raise ValueError(f"No part has the linked places {sorted(missing)}.")
        for name in sorted(self._wanted):
            self.number(_form_of(name), self._places[name][1], align="right")
        entries: dict[str, object] = {"StructTreeRoot": reference(self.tags.finish())}
        if self._places:
            rows = " ".join(
                f"({name}) [{page} 0 R /XYZ {left:.2f} {top:.2f} 0]"
                for name, (page, _, left, top) in sorted(self._places.items())
            )
            entries["Names"] = f"<</Dests <</Names [{rows}]>>>>"
        return entries

    def _full(self, name: str) -> str:
        return f"{self.key}/{name}" if self.key else name

    def _absolute(self, rect: Rect) -> Rect:
        (left, bottom), (right, top) = (
            self.absolutePosition(rect[0], rect[1]), self.absolutePosition(rect[2], rect[3]),
        )  # fmt: skip
        return left, bottom, right, top


def _form_of(place: str) -> str:
    """Return the name of the form with the page of a place, without what ends a name of PDF."""
    return "page." + place.replace(" ", ".").replace("/", ".")
