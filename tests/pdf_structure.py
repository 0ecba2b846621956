"""Checks a PDF against PDF/UA-1 and PDF/A-2a, as far as pypdf shows it; shares no code with the
writer.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from fontTools.ttLib import TTFont
from lxml import etree
from PIL import ImageCms
from pypdf import PdfReader
from pypdf.generic import ContentStream

SHOWN = {b"Tj", b"TJ", b"'", b'"', b"Do", b"f", b"F", b"f*", b"B", b"B*", b"b", b"b*", b"S", b"s",
         b"sh", b"INLINE IMAGE"}  # fmt: skip
"""Operators that leave a mark on the page."""
NAMESPACES = {
    "dc": "http://purl.org/dc/elements/1.1/", "xmp": "http://ns.adobe.com/xap/1.0/",
    "pdf": "http://ns.adobe.com/pdf/1.3/", "pdfaid": "http://www.aiim.org/pdfa/ns/id/",
    "pdfuaid": "http://www.aiim.org/pdfua/ns/id/",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
}  # fmt: skip


@dataclass
class Node:
    """An element of the structure tree."""

    kind: str
    entry: Any
    kids: list[Node] = field(default_factory=list)
    contents: list[tuple[int, int]] = field(default_factory=list)
    """Page and number of each marked content."""
    annotations: list[Any] = field(default_factory=list)

    def walk(self) -> Iterator[Node]:
        """Yield the node and all below it, in the order of reading."""
        yield self
        for kid in self.kids:
            yield from kid.walk()


def structure(reader: PdfReader) -> Node:
    """Read the tree; every element must name its parent."""
    pages = {page.indirect_reference.idnum: n for n, page in enumerate(reader.pages)}

    def read(entry: Any, parent: Any) -> Node:
        assert entry["/P"] == parent, f"{entry['/S']} names another parent"
        node = Node(entry["/S"], entry)
        for kid in entry.get("/K", []):
            one = kid.get_object()
            if isinstance(one, int):
                node.contents.append((pages[entry.raw_get("/Pg").idnum], int(one)))
            elif one.get("/Type") == "/MCR":
                node.contents.append((pages[one.raw_get("/Pg").idnum], one["/MCID"]))
            elif one.get("/Type") == "/OBJR":
                node.annotations.append(one.raw_get("/Obj"))
            else:
                node.kids.append(read(one, entry))
        return node

    root = reader.trailer["/Root"]["/StructTreeRoot"]
    (document,) = root["/K"]
    return read(document.get_object(), root)


def check(content: bytes, language: str = "en") -> Node:
    """Check everything; return the tree for further checks."""
    reader = PdfReader(io.BytesIO(content), strict=True)
    tree = structure(reader)
    check_contents(reader, tree)
    check_headings(tree)
    check_tables(tree)
    check_lists(tree)
    check_figures(tree)
    check_links(reader, tree)
    check_fonts(reader)
    check_catalogue(reader, language)
    check_metadata(reader)
    check_file(content)
    return tree


def check_contents(reader: PdfReader, tree: Node) -> None:
    """Everything drawn is an artifact or in the tree, once; the parent tree agrees."""
    in_tree = [at for node in tree.walk() for at in node.contents]
    assert len(set(in_tree)) == len(in_tree), "a content is in the tree twice"
    owners = {at: node for node in tree.walk() for at in node.contents}
    numbers = parent_tree(reader)
    drawn = set()
    for n, page in enumerate(reader.pages):
        assert page["/Tabs"] == "/S"
        marks = list(marked(reader, page))
        assert len(set(marks)) == len(marks), f"page {n} uses a number twice"
        parents = numbers[page["/StructParents"]].get_object()
        assert len(parents) == len(marks)
        for mark in marks:
            assert parents[mark].get_object() == owners[n, mark].entry
        drawn |= {(n, mark) for mark in marks}
    assert drawn == set(in_tree)


def marked(reader: PdfReader, page: Any) -> Iterator[int]:
    """Yield the numbers of a page's contents; fail where something is not marked."""
    stack: list[str] = []
    for operands, operator in ContentStream(page["/Contents"].get_object(), reader).operations:
        if operator == b"BDC":
            tag, entries = operands
            assert not (tag == "/Artifact" and stack), "an artifact within a content"
            assert "/MCID" not in entries or not stack, "a content within another"
            stack.append(tag)
            if "/MCID" in entries:
                yield entries["/MCID"]
            else:
                assert tag in ("/Artifact", "/Span")
        elif operator == b"BMC":
            stack.append(operands[0])
        elif operator == b"EMC":
            stack.pop()
        elif operator in SHOWN:
            assert stack, f"{operator!r} is not marked"
    assert not stack


def parent_tree(reader: PdfReader) -> dict[int, Any]:
    """Return the elements of pages and annotations by their keys."""
    flat = reader.trailer["/Root"]["/StructTreeRoot"]["/ParentTree"]["/Nums"]
    keys = [int(key) for key in flat[::2]]
    assert keys == sorted(set(keys))
    return dict(zip(keys, flat[1::2], strict=True))


def check_headings(tree: Node) -> None:
    """The first is H1, and none skips a level."""
    levels = [int(n.kind[2]) for n in tree.walk() if re.fullmatch("/H[1-6]", n.kind)]
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))


def check_tables(tree: Node) -> None:
    """Every row has as many cells, and heads say what they are the head of."""
    for table in (node for node in tree.walk() if node.kind == "/Table"):
        assert table.kids
        assert {row.kind for row in table.kids} == {"/TR"}
        assert len({len(row.kids) for row in table.kids}) == 1
        cells = [cell for row in table.kids for cell in row.kids]
        assert {cell.kind for cell in cells} <= {"/TH", "/TD"}
        heads = [cell for cell in cells if cell.kind == "/TH"]
        assert heads
        assert all(head.entry["/A"]["/Scope"] in ("/Row", "/Column") for head in heads)


def check_lists(tree: Node) -> None:
    """A table of contents has entries of labels and links only."""
    for contents in (node for node in tree.walk() if node.kind == "/TOC"):
        assert {entry.kind for entry in contents.kids} == {"/TOCI"}
        parts = [part for entry in contents.kids for part in entry.kids]
        assert {part.kind for part in parts} == {"/Lbl", "/Reference"}
        links = [part.kids for part in parts if part.kind == "/Reference"]
        assert {tuple(link.kind for link in each) for each in links} == {("/Link",)}


def check_figures(tree: Node) -> None:
    """Every picture has a sentence and its place."""
    for figure in (node for node in tree.walk() if node.kind == "/Figure"):
        assert len(figure.entry["/Alt"]) > 5
        left, bottom, right, top = figure.entry["/A"]["/BBox"]
        assert 0 <= left < right <= 596
        assert 0 <= bottom < top <= 842


def check_links(reader: PdfReader, tree: Node) -> None:
    """Every annotation is in the tree, says where it leads, and leads there."""
    numbers, places = parent_tree(reader), reader.named_destinations
    owners = {link.idnum: node for node in tree.walk() for link in node.annotations}
    found = set()
    for page in reader.pages:
        for link in page.get("/Annots", []):
            one = link.get_object()
            found.add(link.idnum)
            assert one["/Subtype"] == "/Link"
            assert one["/F"] == 4
            assert one["/Contents"]
            assert numbers[one["/StructParent"]].get_object() == owners[link.idnum].entry
            assert owners[link.idnum].kind == "/Link"
            assert owners[link.idnum].contents
            assert one["/Dest"] in places if "/Dest" in one else one["/A"]["/URI"]
    assert found == set(owners)


def check_fonts(reader: PdfReader) -> None:
    """Fonts are embedded, with widths and a right table of characters."""
    fonts = {
        name: one for page in reader.pages for name, one in page["/Resources"]["/Font"].items()
    }
    for name, one in fonts.items():
        font = one.get_object()
        assert "/FontFile2" in font["/FontDescriptor"], name
        assert len(font["/Widths"]) == font["/LastChar"] - font["/FirstChar"] + 1
        assert "/Encoding" not in font  # symbolic
        rows = re.findall(rb"^<(\w\w)> <(\w{4,})>$", font["/ToUnicode"].get_data(), re.MULTILINE)
        for _, char in rows:
            assert bytes.fromhex(char.decode()).decode("utf-16-be") not in ("\0", "\ufeff", "")


def check_glyphs(content: bytes) -> None:
    """Every letter that is shown has a glyph, as wide as its font's dictionary says."""
    reader = PdfReader(io.BytesIO(content))
    shown: dict[str, set[int]] = {}
    for page in reader.pages:
        for operands, operator in ContentStream(page["/Contents"].get_object(), reader).operations:
            if operator == b"Tf":
                name = operands[0]
            elif operator == b"Tj":
                shown.setdefault(name, set()).update(operands[0].original_bytes)
    fonts = reader.pages[0]["/Resources"]["/Font"]
    for name, codes in shown.items():
        font = fonts[name].get_object()
        program = TTFont(io.BytesIO(font["/FontDescriptor"]["/FontFile2"].get_data()))
        (table,) = program["cmap"].tables  # as a symbolic font must have
        for code in codes:
            glyph = table.cmap.get(code, ".notdef")
            assert program.getGlyphID(glyph) > 0, f"{name} lacks {code}"
            width = program["hmtx"][glyph][0] * 1000 / program["head"].unitsPerEm
            said = font["/Widths"][code - font["/FirstChar"]]
            assert abs(said - width) <= 1, f"{name} has another width of {code}"


def check_catalogue(reader: PdfReader, language: str) -> None:
    """The document is marked, has a language, shows its title, and has a colour profile."""
    root = reader.trailer["/Root"]
    assert root["/MarkInfo"] == {"/Marked": True}
    assert root["/Lang"] == language
    assert root["/ViewerPreferences"]["/DisplayDocTitle"]
    (intent,) = (one.get_object() for one in root["/OutputIntents"])
    assert intent["/S"] == "/GTS_PDFA1"
    profile = ImageCms.ImageCmsProfile(io.BytesIO(intent["/DestOutputProfile"].get_data()))
    assert profile.profile.xcolor_space.strip() == "RGB"
    assert intent["/DestOutputProfile"]["/N"] == 3
    for page in reader.pages:
        assert "/Group" not in page
        for one in page["/Resources"].get("/XObject", {}).values():
            picture = one.get_object()
            assert "/Group" not in picture
            if picture["/Subtype"] == "/Image":
                assert picture["/ColorSpace"] in ("/DeviceRGB", "/DeviceGray")
                assert "/SMask" not in picture


def check_metadata(reader: PdfReader) -> None:
    """The metadata agree with the information dictionary."""
    stream = reader.trailer["/Root"]["/Metadata"]
    assert "/Filter" not in stream
    xmp = etree.fromstring(stream.get_data())

    def said(name: str) -> str:
        return " ".join("".join(xmp.find(f".//{name}", NAMESPACES).itertext()).split())

    info = reader.metadata
    assert (said("pdfaid:part"), said("pdfaid:conformance"), said("pdfuaid:part")) == (
        "2", "A", "1",
    )  # fmt: skip
    (title,) = xmp.findall(".//dc:title/rdf:Alt/rdf:li", NAMESPACES)
    assert dict(title.attrib) == {"{http://www.w3.org/XML/1998/namespace}lang": "x-default"}
    assert said("dc:title") == info.title
    assert said("dc:creator") == info.author
    assert said("dc:description") == info.subject
    assert said("pdf:Producer") == info.producer
    assert said("xmp:CreatorTool") == info.creator
    made = f"{info.creation_date:%Y-%m-%dT%H:%M:%SZ}"
    assert said("xmp:CreateDate") == said("xmp:ModifyDate") == made


def check_file(content: bytes) -> None:
    """The file itself is as PDF/A demands."""
    assert content.startswith(b"%PDF-1.7\n%")
    assert all(byte > 127 for byte in content[10:14])
    trailer = content[content.rindex(b"trailer") :]
    assert b"/ID [<" in trailer
    assert b"/Encrypt" not in trailer
    assert b"LZWDecode" not in content
    streams, ends = content.count(b"\nendstream\n"), content.count(b"endstream")
    assert streams == ends
