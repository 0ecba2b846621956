"""The fonts of reports: open ones for most scripts, chosen for each character."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

Weight = Literal[400, 600]
"""Regular, semi-bold."""


@dataclass(frozen=True)
class Face:
    """One font file."""

    family: str
    package: str
    """Package that contains the file."""
    path: str
    """Of the file, from the package's folder."""

    @property
    def is_variable(self) -> bool:
        """Whether the file has all weights."""
        return "[" in self.path

    @cached_property
    def file(self) -> Path | None:
        """Path of the file; None where its package is not installed: most are of the extra
        `fonts`.
        """
        spec = find_spec(self.package)
        if spec is None or not spec.submodule_search_locations:
            return None
        return Path(spec.submodule_search_locations[0]) / self.path


def _noto(script: str, pack: str, axes: str = "wdth,wght") -> Face:
    name = f"NotoSans{script}"
    path = f"fonts/ofl/{name.lower()}/{name}[{axes}].ttf"
    return Face(f"Noto Sans {script}", f"justmytype_intl_{pack}", path)


LATIN = Face("Noto Sans", "fontpkg_noto_sans", "files/NotoSans[wdth,wght].ttf")
FACES = (
    LATIN,
    *(_noto(script, "rtl") for script in ("Arabic", "Hebrew")),
    *(_noto(script, "south_asia") for script in ("Tamil", "Devanagari", "Bengali", "Telugu")),
    *(_noto(script, "sea") for script in ("Thai", "Khmer", "Lao", "Myanmar")),
    *(_noto(script, "cjk", "wght") for script in ("SC", "TC", "JP", "KR")),
    Face("DejaVu Sans", "matplotlib", "mpl-data/fonts/ttf/DejaVuSans.ttf"),
)
"""The first font that has a character shows it."""


@cache
def installed() -> list[Face]:
    """Return the fonts whose packages are there."""
    return [face for face in FACES if face.file is not None]


@cache
def _characters(face: Face) -> frozenset[int]:
    if face.file is None:
        return frozenset()
    from fontTools.ttLib import TTFont  # here, as most texts are ASCII

    with TTFont(face.file, lazy=True) as font:
        return frozenset(font.getBestCmap())


def has(face: Face, char: str) -> bool:
    """Return whether the font shows the character."""
    return ord(char) in _characters(face)


@lru_cache(4096)
def face_of(char: str) -> Face | None:
    """Return the font that shows a character; None if there is none."""
    return next((face for face in FACES if has(face, char)), None)
