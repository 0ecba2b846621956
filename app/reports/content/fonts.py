"""The fonts of the document: open ones for most scripts, chosen for each character.

The files are variable fonts, but ReportLab embeds static ones. So each weight is made once per
process on first use, in milliseconds (a third of a second for all of Chinese).
"""

from __future__ import annotations

import io
import threading
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import uharfbuzz as hb
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

Weight = Literal[400, 600]
"""Regular, semi-bold."""

LOCK = threading.RLock()
"""Held while using fonts: they and the glyphs added by shaping are shared by the whole process."""


@dataclass(frozen=True)
class Face:
    """One font file."""

    name: str
    package: str
    """Package that contains the file."""
    path: str
    is_shaped: bool = False
    """Whether its letters change with their neighbours."""
    is_large: bool = False
    """Thousands of characters, at 1.5 KB each in ReportLab: there is only one weight."""
    codec: str | None = None
    """Only the characters of this encoding are used; None: all."""

    @property
    def file(self) -> Path | None:
        """Path of the file; None where its package is not installed: most are of the extra
        `fonts`.
        """
        spec = find_spec(self.package)
        if spec is None or not spec.submodule_search_locations:
            return None
        return Path(spec.submodule_search_locations[0]) / self.path


def _shaped(script: str, pack: str) -> Face:
    return _noto(script, pack, "wdth,wght", is_shaped=True)


def _large(script: str, codec: str | None = None) -> Face:
    """Use all of the font, or only its common characters: a quarter of the memory."""
    face = _noto(script, "cjk", "wght")
    name = f"{face.name}-{codec}" if codec else face.name
    return replace(face, name=name, is_large=True, codec=codec)


def _noto(script: str, pack: str, axes: str, *, is_shaped: bool = False) -> Face:
    name = f"NotoSans{script}"
    path = f"fonts/ofl/{name.lower()}/{name}[{axes}].ttf"
    return Face(name, f"justmytype_intl_{pack}", path, is_shaped)


LATIN = Face("NotoSans", "fontpkg_noto_sans", "files/NotoSans[wdth,wght].ttf")
FACES = (
    LATIN,
    *(_shaped(script, "rtl") for script in ("Arabic", "Hebrew")),
    *(_shaped(script, "south_asia") for script in ("Tamil", "Devanagari", "Bengali", "Telugu")),
    *(_shaped(script, "sea") for script in ("Thai", "Khmer", "Lao", "Myanmar")),
    _large("SC", "gb2312"),
    _large("TC", "big5"),
    _large("JP", "shift_jis"),
    _large("KR", "euc_kr"),
    *map(_large, ("SC", "TC", "JP", "KR")),
    Face("DejaVuSans", "matplotlib", "mpl-data/fonts/ttf/DejaVuSans.ttf"),
)
"""The first font that has a character shows it."""


@cache
def _face_data(face: Face) -> hb.Face:
    if face.file is None:
        raise RuntimeError(
            f"The package {face.package} with the font {face.name} is not installed."
        )
    return hb.Face(hb.Blob.from_file_path(str(face.file)))


@cache
def _characters(face: Face) -> frozenset[int]:
    if face.file is None:
        return frozenset()
    known = frozenset(_face_data(face).unicodes)
    if face.codec is None:
        return known
    written = "".join(map(chr, known)).encode(face.codec, "ignore")
    return known & set(map(ord, written.decode(face.codec, "ignore")))


def has(face: Face, char: str) -> bool:
    """Return whether the font shows the character."""
    return ord(char) in _characters(face)


@lru_cache(4096)
def face_of(char: str) -> Face | None:
    """Return the font that shows a character; None if there is none."""
    return next((face for face in FACES if has(face, char)), None)


@cache
def _registered(face: Face, weight: Weight) -> TTFont:
    name = f"{face.name}-{weight}"
    source = _face_data(face)
    axes = {axis.tag for axis in source.axis_infos}
    wanted = hb.SubsetInput()
    if face.codec:
        wanted.unicode_set.update(_characters(face))
    else:
        wanted.keep_everything()
    if "wght" in axes:
        wanted.pin_axis_location(source, "wght", float(weight))
    for axis in axes - {"wght"}:
        wanted.pin_axis_to_default(source, axis)
    static = hb.subset(source, wanted) if axes else source
    font = TTFont(name, io.BytesIO(static.blob.data))
    # Weights of one file share its name, and of fonts with one name ReportLab keeps the first.
    font.face.name = name.encode()
    pdfmetrics.registerFont(font)
    return font


def font_of(face: Face, weight: Weight) -> TTFont:
    """Return the font for ReportLab, registered under its `fontName`."""
    with LOCK:
        return _registered(face, 400 if face.is_large else weight)
