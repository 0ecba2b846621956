"""XML elements of which only the filled ones are written."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from app.reports.exchange.ascii import one_line


def child(parent: Element, name: str, text: object = None, **attributes: str) -> Element:
    """A new last element of the parent, which may hold text."""
    element = SubElement(parent, name, attributes)
    if text is not None:
        element.text = one_line(str(text))
    return element


def children(parent: Element, values: Mapping[str, object]) -> Element:
    """An element for every value that is there, in their order; the parent."""
    for name, value in values.items():
        if value is not None and value != "":
            child(parent, name, value)
    return parent


def to_bytes(root: Element, declaration: str, encoding: str) -> bytes:
    """The document with CRLF; letters that the encoding lacks become character references."""
    indent(root, "")
    lines = f"{declaration}\n{tostring(root, encoding='unicode')}\n"
    return lines.replace("\n", "\r\n").encode(encoding, "xmlcharrefreplace")
