"""What the columns of a foreign table of assets hold, guessed by their names and their cells."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, pairwise
from statistics import median

from app.survey.assets.cells import (
    DIAMETER,
    KEY,
    MEANINGS,
    PLACE,
    SHOWN,
    UNITS_MM,
    Column,
    own_unit,
    unit_named,
    value_in,
)
from app.survey.assets.register import InvalidLine, line_of, one_line
from app.survey.fields.header import ASSET_FIELDS, BY_NAME
from app.survey.fields.values import InvalidValue
from app.survey.folding import folded

Cells = Sequence[str]
"""Cells of a column that are not empty."""

_NODE = r"(node|mh|manhole|schacht\w*|shaft|chamber|knoten\w*|punkt|point|structure|lurang|nod|id)"
_START = r"(from|von|start|begin|anfang|anfangs|dari|mula|permulaan)"
_END = r"(to|bis|nach|end|ende|ziel|ke|akhir|tamat)"
_UP = r"(us|u s|ups|up ?stream|upper|ob(en|ere\w*)|hulu)"
_DOWN = r"(ds|d s|dns|down ?stream|lower|unten|untere\w*|hilir)"
_LENGTH = r"(length|len|lange|laenge|panjang)"
_ID = r"(id|no|nr|nummer|number|name|nama|bezeichnung|ref|reference|code|key|tag)"
_ASSET = (
    r"(asset|facility|pipe|sewer|section|segment|conduit|culvert|haltungs?|leitungs?|kanal|aset)"
)

_NAMES: tuple[tuple[str, str], ...] = (
    ("wkt", r"\b(wkt|geom|geometry|the geom)\b"),
    ("end_lat", rf"\b({_END}|{_DOWN})\b.*\b(lat|latitude|breitengrad)\b"),
    ("end_lon", rf"\b({_END}|{_DOWN})\b.*\b(lon|long|lng|longitude|langengrad)\b"),
    ("start_lat", r"\b(lat|latitude|breitengrad|latitud)\b"),
    ("start_lon", r"\b(lon|long|lng|longitude|langengrad|longitud)\b"),
    (KEY, rf"^{_ASSET} ?{_ID}$|^(haltung|haltnam|plr|asset|culvert)$"),
    (KEY, rf"^{_ASSET}$|^{_ID}$"),
    ("start_node", rf"^{_START}$|\b{_START}(\b.*\b)?{_NODE}\b|\b{_NODE} {_START}\b"),
    ("end_node", rf"^{_END}$|\b{_END}(\b.*\b)?{_NODE}\b|\b{_NODE} {_END}\b"),
    ("start_node", rf"\b{_UP} ?{_NODE}\b|\bsch(acht)? ?oben\b"),
    ("end_node", rf"\b{_DOWN} ?{_NODE}\b|\bsch(acht)? ?unten\b"),
    ("upstream_node", rf"\b{_UP} ?{_NODE}\b|\bsch(acht)? ?oben\b"),
    ("downstream_node", rf"\b{_DOWN} ?{_NODE}\b|\bsch(acht)? ?unten\b"),
    ("width_mm", r"\b(width|span|breite|profilbreite|lebar)\b"),
    ("height_mm", r"\b(height|rise|hohe|hoehe|profilhohe|profilhoehe|tinggi)\b"),
    (DIAMETER, r"\b(dn|nw|dia|diam|diameter|durchmesser|nennweite|garis pusat|size|nominal)\b"),
    ("lining_material", r"\b(lining|liner|auskleidung\w*)\b.*\b(mat\w*|werkstoff)\b"),
    ("lining_type", r"\b(lining|liner|auskleidung|pelapik)\w*\b"),
    ("material", r"\b(material|matl|mat|werkstoff|rohrmaterial|bahan)\b"),
    ("shape", r"\b(\w*shape|profile?|profil(art|typ|nam)|querschnitt\w*|bentuk)\b|^cross section$"),
    ("asset_type", r"\b(system|kanalart|\w*nutzung|entwasserung\w*|entwart|use|type|jenis)\b"),
    ("unit_length_m", rf"\b(unit|joint)\b.*\b({_LENGTH}|spacing)\b|\b(bau|rohr)(lange|laenge)\b"),
    ("expected_length_m", rf"\b(expected|planned|soll)\w*\b.*{_LENGTH}\b"),
    ("known_length_m", rf"{_LENGTH}\b"),
    ("year", r"\b(year|yr|built|install\w*|construct\w*|jahr|baujahr|tahun)\b"),
    ("road", r"\b(road|street|strasse|strassenname|highway|jalan)\b"),
    ("road_chainage", r"\b(chainage|stationierung|km)\b"),
    ("location_text", r"\b(location|address|lage|ort|ortsteil|lokasi)\b"),
    ("client", r"\b(client|owner|owned|ownedby|auftraggeber|eigentumer|betreiber|pemilik)\b"),
    ("project", r"\b(project|projekt|projek|scheme|contract)\b"),
)  # fmt: skip
"""Names of columns in English, German and Malay, as `_plain` returns them: the first that fits."""
_PIPES_MM = frozenset(
    (100, 110, 125, 150, 160, 200, 225, 250, 300, 315, 350, 375, 400, 450, 500, 525, 600, 675, 700,
     750, 800, 900, 1000, 1050, 1100, 1200, 1350, 1400, 1500, 1600, 1650, 1800, 2000, 2100, 2400)
)  # fmt: skip
_PIPES_IN = frozenset((4, 6, 8, 10, 12, 14, 15, 16, 18, 20, 21, 24, 27, 30, 33, 36, 42, 48, 54, 60))
_LEAST_MM = 75
"""Nobody inspects a pipe of a smaller diameter: such a number is not in mm."""
_HIGHEST_M, _LONGEST_UNIT_M = 10, 15
"""Greatest height and unit length of a pipe."""
_MOST = 0.8
"""Share of the cells that must fit a guess."""


def guessed(
    names: Sequence[str], rows: Sequence[Sequence[str]], *, has_decimal_commas: bool
) -> list[Column | None]:
    """Return what each column holds, None where that is not known.

    Args:
        names: The first row.
        rows: Some rows after it; those at the start of the file tell enough.
        has_decimal_commas: Whether a comma may stand in a number.
    """
    cells = [[row[at] for row in rows if at < len(row) and row[at]] for at in range(len(names))]
    return _Guess(names, cells, has_decimal_commas=has_decimal_commas).columns()


class _Guess:
    """Gives each meaning to one column at most: by names first, then by cells."""

    def __init__(
        self, names: Sequence[str], cells: Sequence[Cells], *, has_decimal_commas: bool
    ) -> None:
        self._written = [one_line(name)[:SHOWN] for name in names]
        self._units = [_unit_in(name) for name in self._written]
        self._names = [_plain(name) for name in self._written]
        self._cells = cells
        self._has_decimal_commas = has_decimal_commas
        self._columns: list[Column | None] = [None] * len(names)

    def columns(self) -> list[Column | None]:
        for at, own in enumerate(re.sub(r"[\s-]+", "_", name.lower()) for name in self._written):
            if own in MEANINGS:
                self._give(at, own, self._units[at] or own_unit(own))
        for at, field in chain(self._by_code(), self._by_name()):
            self._try(at, field)
        for field, is_like, is_sure in _BY_CELLS:
            for at in self._free():
                says_nothing = _SAYS_NOTHING.fullmatch(self._names[at]) is not None
                if (is_sure or says_nothing) and self._is_mostly(is_like, at):
                    self._try(at, field)
        self._guess_nodes()
        self._guess_key()
        return self._columns

    def _by_code(self) -> Iterator[tuple[int, str]]:
        """Yield columns that are named as an exchange format names them."""
        for at, written in enumerate(self._written):
            if (field := _BY_CODE.get(written.lower())) is not None:
                yield at, field

    def _by_name(self) -> Iterator[tuple[int, str]]:
        for field, pattern in _NAMES:
            for at in self._free():
                if re.search(pattern, self._names[at]):
                    yield at, field

    def _guess_nodes(self) -> None:
        """Find two columns of names that occur in both: sections that follow each other."""
        if self._has("start_node") or self._has("end_node"):
            return
        texts = [at for at in self._free() if self._is_mostly(_is_name, at)]
        for start, end in pairwise(texts):
            one, other = set(self._cells[start]), set(self._cells[end])
            if len(one & other) >= max(min(len(one), len(other)) / 2, 2):
                self._give(start, "start_node", None)
                self._give(end, "end_node", None)
                return

    def _guess_key(self) -> None:
        """Take the first full column of different names, with letters if there is one."""
        rows = max(map(len, self._cells), default=0)
        full = [at for at in self._free() if len(set(self._cells[at])) == rows]
        for is_like in (_has_letter, _is_name):
            for at in full:
                if self._is_mostly(is_like, at):
                    self._give(at, KEY, None)

    def _free(self) -> Iterator[int]:
        return (at for at, column in enumerate(self._columns) if column is None)

    def _has(self, field: str) -> bool:
        return any(column is not None and column.field == field for column in self._columns)

    def _is_mostly(self, is_like: Callable[[str], bool], at: int) -> bool:
        cells = self._cells[at]
        return bool(cells) and sum(map(is_like, cells)) >= _MOST * len(cells)

    def _try(self, at: int, field: str) -> None:
        """Give a column its meaning if its cells can be read so, and ids differ."""
        cells = self._cells[at]
        column = Column(field, self._unit_of(at, field))
        if field == KEY:
            is_like = len(set(cells)) >= _MOST * len(cells)
        else:
            is_like = self._is_mostly(lambda cell: self._is_read(column, cell), at)
        if is_like or not cells:
            self._give(at, field, column.unit)

    def _give(self, at: int, field: str, unit: str | None) -> None:
        if self._columns[at] is None and not self._has(field):
            self._columns[at] = Column(field, unit if own_unit(field) else None)

    def _is_read(self, column: Column, cell: str) -> bool:
        try:
            if column.field == "material":
                return _has_letter(cell)
            if column.field == "wkt":
                line_of(cell)
            elif column.field in PLACE:
                float(cell.replace(",", "."))
            elif column.field in ASSET_FIELDS or column.field == DIAMETER:
                value = value_in(column, cell, has_decimal_commas=self._has_decimal_commas)
                return column.field != "unit_length_m" or float(str(value)) <= _LONGEST_UNIT_M
        except (InvalidLine, InvalidValue, ValueError):
            return False
        return True

    def _unit_of(self, at: int, field: str) -> str | None:
        """Return the unit that the name states, else the one that makes the numbers sensible."""
        own = own_unit(field)
        numbers = sorted(self._numbers(at))
        if own is None or self._units[at] is not None or not numbers:
            return self._units[at] or own
        middle = median(numbers)
        if own == "mm" and middle < _LEAST_MM:
            are_whole = all(number.is_integer() for number in numbers)
            return "in" if are_whole or middle > _HIGHEST_M else "m"
        if field == "unit_length_m" and middle > _LONGEST_UNIT_M:
            return "mm"
        in_inches = any(column is not None and column.unit == "in" for column in self._columns)
        return "ft" if own == "m" and in_inches else own

    def _numbers(self, at: int) -> Iterator[float]:
        for cell in self._cells[at]:
            found = re.search(r"[0-9]+(?:[.,][0-9]+)?", cell)
            if found:
                yield float(found[0].replace(",", "."))


def _plain(name: str) -> str:
    """Return the words of a name, in small letters and without its unit: 'FromMH' is from mh."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", _IN_BRACKETS.sub(" ", name))
    found = " ".join(re.findall(r"[^\W_]+", folded(words)))
    return re.sub(rf" ({'|'.join(UNITS_MM)})$", "", found)


def _unit_in(name: str) -> str | None:
    """Return the unit that a name states: 'Dia (in)', 'length_ft', 'Höhe [mm]'."""
    for text in (*_IN_BRACKETS.findall(name), *re.split(r"[\s_]+", name)[1:][-1:]):
        if unit := unit_named(text):
            return unit
    return None


_IN_BRACKETS = re.compile(r"[(\[]([^)\]]*)[)\]]")


def _is_name(cell: str) -> bool:
    """Return whether a cell may name a thing: a word, or a whole number."""
    return not re.fullmatch(r"[0-9]+[.,][0-9]+|[0-9./-]{8,10}", cell)


def _has_letter(cell: str) -> bool:
    return any(letter.isalpha() for letter in cell)


def _is_wkt(cell: str) -> bool:
    return cell.upper().startswith(("POINT", "LINESTRING", "MULTILINESTRING", "SRID="))


def _is_year(cell: str) -> bool:
    return re.fullmatch(r"(19|20)[0-9]{2}", cell) is not None


def _is_material(cell: str) -> bool:
    values = BY_NAME["material"].values
    return values is not None and bool(values.meaning_of(cell) or values.value("isybau", cell))


def _is_shape(cell: str) -> bool:
    values = BY_NAME["shape"].values
    return values is not None and values.meaning_of(cell) is not None


def _is_diameter(cell: str) -> bool:
    found = re.fullmatch(r"(?:DN|Ø)?\s*([0-9]+)(?:[.,]0+)?", cell)
    return found is not None and int(found[1]) in _PIPES_MM | _PIPES_IN


def _is_length(cell: str) -> bool:
    return re.fullmatch(r"[0-9]{1,3}[.,][0-9]{1,3}", cell) is not None


_SAYS_NOTHING = re.compile(r"[a-z]?|(col|column|field|feld|spalte|lajur|unnamed)? ?[0-9]*")
_BY_CELLS: tuple[tuple[str, Callable[[str], bool], bool], ...] = (
    ("wkt", _is_wkt, True),
    ("shape", _is_shape, True),
    ("material", _is_material, True),
    ("year", _is_year, False),
    (DIAMETER, _is_diameter, False),
    ("known_length_m", _is_length, False),
)
"""What cells are like that mean one thing; numbers do so only under a name that says nothing: they
may be a slope or a level, too.
"""
_BY_CODE = {
    code.lower(): name
    for name in (KEY, *ASSET_FIELDS)
    for place in BY_NAME[name].columns.values()
    for code in place.codes
}
"""Meanings by the names of exchange formats."""
