"""XML elements, written only where they are filled."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

from app.reports.report import Loss
from app.reports.text.ascii import one_line


def child(parent: Element, name: str, text: object = None, **attributes: str) -> Element:
    """Append an element to the parent, which may hold text."""
    element = SubElement(parent, name, attributes)
    if text is not None:
        element.text = one_line(str(text))
    return element


def children(parent: Element, values: Mapping[str, object]) -> Element:
    """Append an element for every filled value, in order; return the parent."""
    for name, value in values.items():
        if value is not None and value != "":
            child(parent, name, value)
    return parent


def fill_template(template: str, values: Mapping[str, str], keep: Collection[str] = ()) -> Element:
    """Return a template whose empty elements hold the values of their names.

    Those without a value are left out, and what is empty by that.

    Args:
        template: XML; texts in it stand as they are.
        values: Texts by the names of elements.
        keep: Elements that stay although they are empty.
    """
    root = fromstring(template)  # noqa: S314  (a template of ours)
    _fill(root, values, keep)
    return root


def _fill(parent: Element, values: Mapping[str, str], keep: Collection[str]) -> None:
    parent.text = None
    for element in list(parent):
        element.tail = None
        if len(element):
            _fill(element, values, keep)
        elif not element.text:
            element.text = one_line(values.get(element.tag, "")) or None
        if not len(element) and not element.text and element.tag not in keep:
            parent.remove(element)


class Shared:
    """Elements that several inspections of a file refer to by a name; each is written once."""

    def __init__(self) -> None:
        self._elements: dict[str, Element] = {}

    def add(self, name: str, element: Element) -> list[Loss]:
        """Add an element unless its name is there; return the loss where the one there differs."""
        known = self._elements.setdefault(name, element)
        return [] if tostring(known) == tostring(element) else [Loss("written_once", name=name)]

    def append_to(self, parent: Element) -> None:
        """Append them to an element of the file, in the order of their first inspection."""
        parent.extend(self._elements.values())


def to_bytes(root: Element, declaration: str, encoding: str) -> bytes:
    """Return the document with CRLF; letters missing in the encoding become character
    references.
    """
    indent(root, "")
    lines = f"{declaration}\n{tostring(root, encoding='unicode')}\n"
    return lines.replace("\n", "\r\n").encode(encoding, "xmlcharrefreplace")
