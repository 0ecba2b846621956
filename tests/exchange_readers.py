"""Readers of the exchange formats, written from their rules and not from our writers.

Each returns the header and the observations as plain mappings of text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

ISYBAU_NS = "{http://www.bfr-abwasser.de}"

ISYBAU_ORDER = {
    "OptischeInspektion": (
        "Auftragskennung", "Inspektionsdatum", "Inspektionsverfahren", "NameUntersucher", "Uhrzeit",
        "Wetter", "Temperatur", "Reinigung", "Wasserhaltung", "VideoSpeichermedium",
        "Videoablagereferenz", "Bemerkung", "Rohrleitung",
    ),
    "Rohrleitung": (
        "Rohrleitungstyp", "Inspektionsrichtung", "BezugspunktLage", "Inspektionslaenge",
        "Inspektionsart", "ArtVideoreferenz", "RGrunddaten", "Inspektionsdaten",
    ),
    "RGrunddaten": (
        "KnotenZulauf", "KnotenZulaufTyp", "KnotenAblauf", "KnotenAblaufTyp", "Profilhoehe",
        "Profilbreite", "Profilart", "Material", "Regeleinzelrohrlaenge",
    ),
    "RZustand": (
        "Index", "Station", "Timecode", "InspektionsKode", "Charakterisierung1",
        "Charakterisierung2", "Verbindung", "Quantifizierung1Numerisch", "Quantifizierung1Text",
        "Quantifizierung2Numerisch", "Quantifizierung2Text", "Streckenschaden",
        "StreckenschadenLfdNr", "PositionVon", "PositionBis", "GrundAbbruch", "Fotodatei",
        "Kommentar",
    ),
    "AbwassertechnischeAnlage": (
        "Objektbezeichnung", "Objektart", "Status", "Baujahr", "Entwaesserungsart", "Kante",
        "Knoten", "Lage", "Geometrie",
    ),
    "InspizierteAbwassertechnischeAnlage": (
        "Objektbezeichnung", "Anlagentyp", "Lage", "OptischeInspektion",
    ),
    "Auftrag": (
        "Auftragsbezeichnung", "Auftragsnummer", "Auftragskennung", "Auftragsart",
        "Inspektionszweck", "Kodiersystem",
        "Auftragnehmer",
    ),
    "Film": ("Filmname", "Auftragskennung", "Videoablagereferenz", "FilmObjekte"),
}  # fmt: skip
"""Order of the elements in the official schema."""
ISYBAU_VALUES = {
    "Station": r"\d{1,3}\.\d\d",
    "Inspektionslaenge": r"\d{1,3}\.\d\d",
    "Regeleinzelrohrlaenge": r"\d{1,2}\.\d\d",
    "Timecode": r"\d{8}",
    "Quantifizierung1Numerisch": r"-?\d{1,4}\.\d\d",
    "Quantifizierung2Numerisch": r"-?\d{1,4}\.\d\d",
    "Quantifizierung1Text": r".{1,30}",
    "Quantifizierung2Text": r".{1,30}",
    "InspektionsKode": r"[A-Z]{3}",
    "Verbindung": r"[01]",
    "Streckenschaden": r"[ABC]",
    "StreckenschadenLfdNr": r"[1-9]\d?",
    "PositionVon": r"0[1-9]|1[0-2]",
    "PositionBis": r"0[0-9]|1[0-2]",
    "Objektbezeichnung": r".{1,30}",
    "NameUntersucher": r".{1,40}",
    "Auftragsbezeichnung": r".{1,60}",
    "Auftragskennung": r"\d{1,6}",
    "Fotodatei": r".{1,255}",
    "GrundAbbruch": r"GE|GN|IN|AV|ZE",
    "Strassenname": r".{1,40}",
    "Auftragsnummer": r".{1,40}",
    "Baujahr": r"\d{4}",
    "Kommentar": r"\S+( \S+)*",
    "Inspektionsrichtung": r"[OU]",
    "BezugspunktLage": r"[1-4]",
    "Profilhoehe": r"\d{1,4}",
    "Profilbreite": r"\d{1,4}",
    "Wetter": r"[123]",
    "Wasserhaltung": r"[1-6]",
    "Material": r"[A-Z]{1,4}",
}
M150_VALUES = {
    "KG001": r".{1,16}",
    "HG001": r".{1,33}",
    "HG003": r".{1,16}",
    "HG004": r".{1,16}",
    "HG303": r"\d{1,4}",
    "HG306": r"\d{1,4}",
    "HG307": r"\d{1,4}",
    "HG310": r"\d{1,4}\.\d{3}",
    "HG314": r"\d{1,3}\.\d{3}",
    "HI101": r"[IG]",
    "HZ001": r"\d{1,4}\.\d",
    "HZ002": r"[A-Z]{3}",
    "HZ003": r"(?=.{1,7}$)-?\d+\.\d",
    "HZ004": r"(?=.{1,7}$)-?\d+\.\d",
    "HZ005": r"[ABC][1-9]\d?",
    "HZ006": r"0[1-9]|1[0-2]",
    "HZ007": r"0[1-9]|1[0-2]",
    "HZ008": r"\d\d:[0-5]\d:[0-5]\d",
    "HZ014": r".{1,6}",
    "HZ015": r".{1,2}",
}


@dataclass
class Read:
    """The content of a file."""

    header: dict[str, str]
    rows: list[dict[str, str]]
    more: dict[str, Any] = field(default_factory=dict)


def read_en13508(content: bytes) -> Read:
    """Read by hand, in the encoding that it names: quotes are resolved character by character."""
    named = content.partition(b"\r\n")[0].decode().removeprefix("#A1=")
    assert named == ("ISO-8859-1" if content.isascii() else "UTF-8")
    text = content.decode(named)
    assert text.endswith("#Z\r\n")
    lines = text[:-2].split("\r\n")
    assert all(lines), "a reader stops at an empty line"
    assert not any("\n" in line or "\r" in line for line in lines)
    assert lines[1:6] == ["#A2=en", "#A3=;", "#A4=.", '#A5="', "#A6=2010"]
    assert sum(line.startswith("#") for line in lines) == 9
    assert lines[6].startswith("#B01=")
    names, values = lines[6][5:].split(";"), _split(lines[7])
    assert len(names) == len(values) == len(set(names))
    assert lines[8].startswith("#C=")
    columns = lines[8][3:].split(";")
    rows = [_split(line) for line in lines[9:-1]]
    assert {len(row) for row in rows} <= {len(columns)}
    return Read(
        dict(zip(names, values, strict=True)),
        [dict(zip(columns, row, strict=True)) for row in rows],
    )


def split(kind: str, content: bytes) -> list[bytes]:
    """Split a file of several inspections into files of one each, as its format allows it."""
    if kind == "en13508":
        head, *blocks = re.split(rb"(?m)^(?=#B01=)", content)
        return [head + block for block in blocks]
    root = etree.fromstring(content)
    block = {"en13508xml": "ZB", "ribx": "ZB_A"}[kind]
    count = len(root.findall(block))
    return [_only(content, block, number) for number in range(count)]


def _only(content: bytes, block: str, number: int) -> bytes:
    root = etree.fromstring(content)
    for each in [one for n, one in enumerate(root.findall(block)) if n != number]:
        root.remove(each)
    return bytes(etree.tostring(root))


def _split(line: str) -> list[str]:
    cells, cell, at = [], "", 0
    while at < len(line):
        if line[at] == '"':
            assert not cell, "a quote within a value that is not quoted"
            at += 1
            while line[at] != '"' or line[at + 1 : at + 2] == '"':
                at += line[at] == '"'
                cell += line[at]
                at += 1
            at += 1
            assert line[at : at + 1] in (";", ""), "something behind a quoted value"
            assert ";" in cell or '"' in cell, "quoted without need"
        elif line[at] == ";":
            cells.append(cell)
            cell = ""
            at += 1
        else:
            cell += line[at]
            at += 1
    return [*cells, cell]


def read_ribx(content: bytes) -> Read:
    """Read like GWSW readers: blocks by the code of the inspection date, coordinates by gml:pos."""
    content.decode("ascii")
    root = etree.fromstring(content)
    assert root.tag == "DATA"
    assert [child.tag for child in root[0]] == ["A2", "A6"]
    assert root[0].findtext("A6") == "RIBX 1.5.1"
    (pipe,) = root.findall("ZB_A")
    header, rows, explained, points = {}, [], {}, {}
    for element in pipe:
        if element.tag == "ZC":
            rows.append({child.tag: child.text for child in element})
            assert [child.tag for child in element] == sorted(child.tag for child in element)
            assert all(child.text for child in element), "empty elements are left out"
            continue
        position = element.find("{http://www.opengis.net/gml}Point/{http://www.opengis.net/gml}pos")
        if position is not None:
            points[element.tag] = [float(number) for number in position.text.split()]
        else:
            header[element.tag] = element.text
        if element.get("ADE"):
            explained[element.tag] = element.get("ADE")
    assert list(header) == sorted(header)
    assert header["AAB"] in (header["AAD"], header["AAF"])
    return Read(header, rows, {"explained": explained, "points": points})


def read_en13508_xml(content: bytes) -> Read:
    """Read like a strict reader: `ZB` by its name, nothing in `ZA` but language and edition."""
    content.decode("ascii")
    root = etree.fromstring(content)
    assert (root.tag, [child.tag for child in root]) == ("DATA", ["ZA", "ZB"])
    assert [(child.tag, child.text) for child in root[0]] == [("A2", "en"), ("A6", "2010")]
    elements = [child for child in root[1] if child.tag != "ZC"]
    header = {child.tag: child.text for child in elements}
    assert all(re.fullmatch(r"A[A-E][A-Z]", name) for name in header)
    assert [child.tag for child in root[1]][: len(header)] == sorted(header), "header first"
    rows = [{child.tag: child.text for child in row} for row in root[1].findall("ZC")]
    assert all(list(row) == sorted(row) and all(row.values()) for row in rows)
    assert header["AAB"] in (header["AAD"], header["AAF"])
    return Read(header, rows)


def read_isybau(content: bytes) -> Read:
    """Read with order, lengths and references of the official schema."""
    assert content.startswith(b'<?xml version="1.0" encoding="ISO-8859-1" standalone="yes"?>\r\n')
    assert content.count(b"\n") == content.count(b"\r\n")
    root = etree.fromstring(content)
    assert root.tag == f"{ISYBAU_NS}Identifikation"
    for element in root.iter():
        name = element.tag.removeprefix(ISYBAU_NS)
        if name in ISYBAU_ORDER:
            found = [child.tag.removeprefix(ISYBAU_NS) for child in element]
            assert found == [known for known in ISYBAU_ORDER[name] if known in found], name
        if name in ISYBAU_VALUES:
            assert re.fullmatch(ISYBAU_VALUES[name], element.text or ""), (name, element.text)

    def texts(path: str) -> list[str]:
        full = "/".join(f"{ISYBAU_NS}{step}" for step in path.split("/"))
        return [element.text for element in root.findall(f".//{full}")]

    keys = texts("Kollektiv/Kennung")
    assert texts("Stammdatenkollektiv/Kennung") + texts("Zustandsdatenkollektiv/Kennung") == keys
    orders = texts("Auftrag/Auftragskennung")
    assert {*texts("OptischeInspektion/Auftragskennung"), *texts("Film/Auftragskennung")} <= {
        *orders
    }
    nodes = set(texts("AbwassertechnischeAnlage/Objektbezeichnung"))
    ends = texts("RGrunddaten/KnotenZulauf") + texts("RGrunddaten/KnotenAblauf")
    assert nodes >= {*ends, *texts("InspizierteAbwassertechnischeAnlage/Objektbezeichnung")}
    inspection = root.find(f".//{ISYBAU_NS}OptischeInspektion")
    header = {
        element.tag.removeprefix(ISYBAU_NS): element.text
        for element in inspection.iter()
        if not len(element) and element.getparent().tag != f"{ISYBAU_NS}RZustand"
    }
    header |= {
        element.tag.removeprefix(ISYBAU_NS): element.text
        for element in root.find(f".//{ISYBAU_NS}Auftrag")
    }
    header |= {"Auftrag": header["Auftragsbezeichnung"]}
    pipe = root.find(f".//{ISYBAU_NS}Kante/..")
    header |= {
        element.tag.removeprefix(ISYBAU_NS): element.text
        for element in pipe.iter()
        if element.tag.removeprefix(ISYBAU_NS) in ("Baujahr", "Laenge", "Strassenname")
    }
    assert set(texts("Lage/Strassenname")) <= {header.get("Strassenname")}
    rows = [
        {child.tag.removeprefix(ISYBAU_NS): child.text for child in element}
        for element in root.iter(f"{ISYBAU_NS}RZustand")
    ]
    assert [row["Index"] for row in rows] == [str(n + 1) for n in range(len(rows))]
    film = texts("Film/Filmname")
    easting = texts("Start/Rechtswert") + texts("Ende/Rechtswert")
    return Read(header, rows, {"film": film, "nodes": nodes, "easting": easting})


def read_m150(content: bytes) -> Read:
    """Read with the formats of the field table; elements in rising number."""
    assert content.startswith(b'<?xml version="1.0" encoding="ISO-8859-1" standalone="no"?>\r\n')
    assert content.count(b"\n") == content.count(b"\r\n")
    root = etree.fromstring(content)
    assert (root.findtext("FD/FD001"), root.findtext("FD/FD002")) == ("04-2010", "B")
    for element in root.iter():
        numbered = [child.tag for child in element if re.fullmatch(r"[A-Z]{2}\d{3}", child.tag)]
        assert numbered == sorted(numbered)
        if element.tag in M150_VALUES:
            assert re.fullmatch(M150_VALUES[element.tag], element.text), (element.tag, element.text)
    nodes = [element.text for element in root.iter("KG001")]
    assert set(nodes) == {root.findtext("HG/HG003"), root.findtext("HG/HG004")}
    assert len(nodes) == len(set(nodes))
    header = {
        element.tag: element.text
        for element in (*root.find("HG"), *root.find("HG/HI"))
        if not len(element)
    }
    rows = [{child.tag: child.text for child in element} for element in root.iter("HZ")]
    easting = [element.text for element in root.find("HG").iter("GP005")]
    return Read(header, rows, {"easting": easting})
