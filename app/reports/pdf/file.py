"""The PDF file, written as it grows: pictures, pages and the tree of tags leave memory at once.

ReportLab itself keeps every object until the end, and the finished file twice more.
"""

from __future__ import annotations

import zlib
from array import array
from collections.abc import Iterable, Mapping
from hashlib import sha256
from typing import IO, Any

from reportlab.pdfbase.pdfdoc import (
    PDFDictionary,
    PDFDocument,
    PDFObject,
    PDFObjectReference,
    PDFPage,
    PDFString,
)
from reportlab.pdfbase.pdfdoc import format as formatted

from app.reports.content.pictures import Jpeg

_STREAM_END = b"endstream\n"
_CMAP = "toUnicodeCMap:"


class File(PDFDocument):
    """The objects of a document; each is written once it is complete."""

    def __init__(self, out: IO[bytes], language: str) -> None:
        super().__init__(compression=1, invariant=1, pdfVersion=(1, 7), lang=language)
        self._out = out
        self._at = 0
        self._offsets = array("Q", [0])
        """Of each object by its number; 0 while it is not written."""
        self._hash = sha256()
        self._pages: list[int] = []
        self._page: int | None = None
        self._page_tree = self.take()
        self.parents_key = 0
        """Under which the present page finds its tags."""
        # Bytes above 127 in the second line mark the file as binary.
        self._write(b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n")

    def _write(self, content: bytes) -> None:
        self._out.write(content)
        self._hash.update(content)
        self._at += len(content)

    def take(self) -> int:
        """Reserve the number of an object, which `put` writes later."""
        self.objectcounter += 1
        return int(self.objectcounter)

    def put(self, number: int, content: bytes) -> None:
        """Write an object."""
        while len(self._offsets) <= number:
            self._offsets.append(0)
        self._offsets[number] = self._at
        if content.endswith(_STREAM_END):  # ReportLab forgets the line break before it
            content = content[: -len(_STREAM_END)] + b"\n" + _STREAM_END
        self._write(b"%d 0 obj\n%s\nendobj\n" % (number, content.rstrip(b"\n")))

    def put_stream(self, number: int, content: bytes, **entries: object) -> None:
        """Write a stream; it is compressed unless the entries name a filter.

        `Filter=None` writes it as it is.
        """
        if "Filter" not in entries:
            content, entries = zlib.compress(content), {**entries, "Filter": "/FlateDecode"}
        named = dictionary({name: value for name, value in entries.items() if value is not None}
                           | {"Length": len(content)})  # fmt: skip
        self.put(number, named + b"\nstream\n" + content + b"\nendstream")

    def text(self, text: str) -> bytes:
        """Format a text string."""
        return bytes(formatted(PDFString(text), self))

    @property
    def page(self) -> int:
        """Number of the object of the present page."""
        if self._page is None:
            self._page = self.take()
            # Bookmarks refer to the page by this name.
            self.idToObjectNumberAndVersion[self.thisPageName()] = (self._page, 0)
        return self._page

    @property
    def page_count(self) -> int:
        """Number of pages that are written; the one being drawn is not among them."""
        return len(self._pages)

    def picture(self, jpeg: Jpeg) -> str:
        """Return the name of a picture, which is written when it occurs for the first time."""
        name = sha256(jpeg.content).hexdigest()[:32]
        key = self.getXObjectName(name)
        if key not in self.idToObjectNumberAndVersion:
            number = self.take()
            self.idToObjectNumberAndVersion[key] = (number, 0)
            width, height = jpeg.size
            self.put_stream(
                number, jpeg.content, Type="/XObject", Subtype="/Image", Width=width,
                Height=height, BitsPerComponent=8, Filter="/DCTDecode",
                ColorSpace="/DeviceGray" if jpeg.is_grey else "/DeviceRGB",
            )  # fmt: skip
        return name

    def xobjDict(self, formnames: Iterable[str]) -> PDFDictionary:  # noqa: N802
        """Return the pictures and forms of a page; a form may be filled in later."""
        for name in map(self.getXObjectName, formnames):
            if name not in self.idToObjectNumberAndVersion:
                self.idToObjectNumberAndVersion[name] = (self.take(), 0)
        return super().xobjDict(formnames)

    def addForm(self, name: str, form: PDFObject) -> None:  # noqa: N802
        """Write a form; `canvas.endForm` calls this."""
        self.xobjDict([name])
        number, _ = self.idToObjectNumberAndVersion[self.getXObjectName(name)]
        self.put(number, formatted(form, self, toplevel=1))
        self.inObject = None

    def addPage(self, page: PDFPage) -> None:  # noqa: N802
        """Write a finished page; `canvas.showPage` calls this."""
        number, contents = self.page, self.take()
        stream = page.stream.encode("latin-1") if isinstance(page.stream, str) else page.stream
        self.put_stream(contents, stream)
        resources = {"Font": PDFObjectReference("BasicFonts")}
        if page.XObjects:
            resources["XObject"] = page.XObjects
        entries = {
            "Type": "/Page",
            "Parent": reference(self._page_tree),
            "MediaBox": f"[0 0 {page.pagewidth:.4f} {page.pageheight:.4f}]",
            "Contents": reference(contents),
            "Resources": b"<<%s>>" % self._formatted(resources),
            "StructParents": self.parents_key,
            "Tabs": "/S",
        }
        if page.Annots:
            entries["Annots"] = b"[%s]" % b" ".join(page.Annots)
        self.put(number, dictionary(entries))
        self._pages.append(number)
        self._page = None
        self.pageCounter += 1
        self.inObject = None

    def _formatted(self, entries: Mapping[str, Any]) -> bytes:
        return b"".join(b"/%s %s" % (k.encode(), formatted(v, self)) for k, v in entries.items())

    def finish(
        self, canvas: Any, catalog: Mapping[str, object], info: Mapping[str, object]
    ) -> None:
        """Write what is left: fonts, bookmarks, page tree, catalogue and the table of objects."""
        for font in self.delayedFonts:
            self._add_font(font)
        bookmarks: Any = self.Outlines
        bookmarks.prepare(self, canvas)
        if bookmarks.ready > 0:
            number, _ = self.idToObjectNumberAndVersion[bookmarks.__InternalName__]
            catalog = {**catalog, "Outlines": reference(number), "PageMode": "/UseOutlines"}
        self.put(self._page_tree, dictionary({
            "Type": "/Pages", "Count": len(self._pages),
            "Kids": b"[%s]" % b" ".join(map(reference, self._pages)),
        }))  # fmt: skip
        root, about = self.take(), self.take()
        self.put(root, dictionary({"Type": "/Catalog", "Pages": reference(self._page_tree),
                                   **catalog}))  # fmt: skip
        self.put(about, dictionary(info))
        number = 0
        while number < self.objectcounter:  # formatting may add objects
            number += 1
            if number >= len(self._offsets) or not self._offsets[number]:
                made = self.idToObject[self.numberToId[number]]
                self.put(number, formatted(made, self, toplevel=1))
        self._write_table(root, about)

    def _add_font(self, font: Any) -> None:
        """Add a font with a right table of its characters.

        ReportLab's has the character 0, which PDF/UA forbids, and no surrogates.
        """
        subsets = [list(subset) for subset in font.state[self].subsets]
        font.addObjects(self)
        name = self.fontMapping[font.fontName][1:]
        for n, subset in enumerate(subsets):
            made: Any = self.idToObject[f"{name}+{n}"]
            table: Any = self.idToObject[_CMAP + made.BaseFont]
            table.content = to_unicode(made.BaseFont, subset)

    def _write_table(self, root: int, about: int) -> None:
        start, size = self._at, len(self._offsets)
        digest = self._hash.hexdigest()[:32]
        rows = b"".join(b"%010d 00000 n \n" % offset for offset in self._offsets[1:])
        trailer = dictionary({
            "Size": size, "Root": reference(root), "Info": reference(about),
            "ID": f"[<{digest}><{digest}>]",
        })  # fmt: skip
        self._write(
            b"xref\n0 %d\n0000000000 65535 f \n%strailer\n%s\nstartxref\n%d\n%%%%EOF\n"
            % (size, rows, trailer, start)
        )


def reference(number: int) -> bytes:
    """Format a reference to an object."""
    return b"%d 0 R" % number


def dictionary(entries: Mapping[str, object]) -> bytes:
    """Format a dictionary of values that are formatted already."""
    return b"<<%s>>" % b" ".join(
        b"/%s %s" % (name.encode(), value if isinstance(value, bytes) else str(value).encode())
        for name, value in entries.items()
    )


def to_unicode(name: str, subset: Iterable[int]) -> bytes:
    """Return the table from codes of a font to characters, as a CMap.

    Args:
        name: Name of the font.
        subset: Character of each code, from 0; 0 for an unused one.
    """
    rows = [
        f"<{code:02X}> <{chr(char).encode('utf-16-be').hex().upper()}>"
        for code, char in enumerate(subset)
        if char
    ]
    blocks = [rows[at : at + 100] for at in range(0, len(rows), 100)]
    lines = [
        "/CIDInit /ProcSet findresource begin", "12 dict begin", "begincmap",
        "/CIDSystemInfo << /Registry (Adobe) /Ordering (UCS) /Supplement 0 >> def",
        f"/CMapName /{name} def", "/CMapType 2 def",
        "1 begincodespacerange", "<00> <FF>", "endcodespacerange",
        *(line for block in blocks
          for line in (f"{len(block)} beginbfchar", *block, "endbfchar")),
        "endcmap", "CMapName currentdict /CMap defineresource pop", "end", "end",
    ]  # fmt: skip
    return "\n".join(lines).encode("ascii")
