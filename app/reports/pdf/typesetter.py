"""Sets a document from templates, data and pictures with Typst."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from html import unescape
from pathlib import Path
from typing import IO, Any

from app.reports.content.pictures import Jpeg
from app.reports.content.sizes import Outline
from app.reports.content.words import Language, words_of
from app.reports.drawings.svg import Drawing, measures
from app.reports.text.fonts import LATIN, has, installed
from app.reports.text.typesetting import clean, is_mark
from app.storage.folder.temporary import temporary_folder

_TEMPLATES = Path(__file__).parent / "templates"
_COMPILE = Path(__file__).parent / "compile.py"
_MOST_S = 1800
"""Longest time for a document; one of 100 inspections takes 10 s."""
_TEXT_OF_SVG = re.compile(
    r'<text x="(?P<x>[^"]+)" y="(?P<y>[^"]+)" font-size="(?P<size>[^"]+)" fill="(?P<fill>[^"]+)" '
    r'text-anchor="(?P<anchor>[^"]+)" font-weight="(?P<weight>[^"]+)">(?P<said>[^<]*)</text>'
)
"""As `app.reports.drawings.svg` writes a text, in millimetres."""


class NotTypeset(RuntimeError):
    """Typst has refused a document: a fault of a template or of its data."""


@dataclass(frozen=True)
class About:
    """What a file states about itself."""

    title: str
    author: str
    subject: str
    language: Language
    made_at: datetime
    """Equal reports have equal files, so it is when the report was made."""


class Workshop:
    """A folder with the templates, to which data and pictures are added before the document is
    set.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files = 0

    def write_data(self, name: str, data: Mapping[str, Any]) -> None:
        """Write data that a template reads, every text in a form that fonts can show."""
        (self._folder / f"{name}.json").write_text(json.dumps(_shown(data)), "utf-8")

    def add_photo(self, jpeg: Jpeg, outlines: Sequence[Outline] = ()) -> str:
        """Add a picture with what was measured on it; return the name of its file.

        It is wrapped in an SVG: Typst decodes a JPEG and keeps its pixels, but embeds one of an
        SVG as it is (1,400 photos took 4.4 GB, and take 0.4 GB).
        """
        name = self._next_name()
        (self._folder / f"{name}.jpg").write_bytes(jpeg.content)
        wide, high = jpeg.size
        drawn = "".join(measures(outlines, wide, high))
        svg = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{high}">'
            f'<image href="{name}.jpg" width="{wide}" height="{high}"/>{drawn}</svg>'
        )
        (self._folder / f"{name}.svg").write_text(svg, "utf-8")
        return f"{name}.svg"

    def add_drawing(self, drawing: Drawing) -> dict[str, Any]:
        """Add a drawing; return it as templates take it.

        Texts that are not in Latin letters are set over it: in an SVG, Typst takes fonts for other
        scripts in a weight of its own, and cannot say what joined letters, or letters with marks
        of their own, stand for.
        """
        name, texts = f"{self._next_name()}.svg", []

        def taken_out(found: re.Match[str]) -> str:
            said = unescape(found["said"])
            if all(has(LATIN, char) and not is_mark(char) for char in said):
                return found[0]
            texts.append({**found.groupdict(), "said": said})
            return ""

        svg = _TEXT_OF_SVG.sub(taken_out, drawing.svg)
        (self._folder / name).write_text(svg, "utf-8")
        return {"file": name, "alt": drawing.alt, "texts": texts}

    def _next_name(self) -> str:
        self._files += 1
        return f"picture-{self._files}"

    def set_document(
        self, template: str, about: About, out: IO[bytes], *, is_large: bool = False
    ) -> None:
        """Set the document that a template describes, as PDF/UA-1 and PDF/A-2a.

        Args:
            template: Its name.
            about: What it states about itself.
            out: Where the PDF goes.
            is_large: Whether another process sets it, whose memory ends with it.

        Raises:
            NotTypeset: Typst has refused it, or its process was ended.
        """
        made_at = about.made_at.astimezone(UTC).replace(microsecond=0)
        parts = ("year", "month", "day", "hour", "minute", "second")
        told = {
            "title": about.title,
            "author": about.author,
            "subject": about.subject,
            "language": about.language,
            "made_at": {part: getattr(made_at, part) for part in parts},
        }
        words = dict(words_of(about.language))
        families = [face.family for face in installed()]
        self.write_data("data", {"about": told, "words": words, "fonts": families})
        pdf = self._folder / "document.pdf"
        folders = sorted({str(face.file.parent) for face in installed() if face.file})
        order = (str(self._folder / f"{template}.typ"), str(pdf), folders, int(made_at.timestamp()))
        (_compile_apart if is_large else _compile_here)(*order)
        with pdf.open("rb") as file:
            shutil.copyfileobj(file, out, 2**20)


def _compile_here(template: str, out: str, font_folders: list[str], made_at_s: int) -> None:
    from typst import TypstError  # here, as it is large, and few commands write a PDF

    from app.reports.pdf import compile as compiler

    try:
        compiler.compile_pdf(Path(template), Path(out), font_folders, made_at_s)
    except TypstError as error:
        raise NotTypeset(f"Typst has refused {template}: {error.diagnostic}") from error
    finally:
        compiler.forget()


def _compile_apart(*order: object) -> None:
    try:
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-I", "-X", "utf8", str(_COMPILE)],
            input=json.dumps(order),
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=False,
            timeout=_MOST_S,
            env={},  # the access token and other secrets stay with the server
        )
    except subprocess.TimeoutExpired as late:
        raise NotTypeset(f"Typst was stopped: {order[0]} took more than {_MOST_S} s.") from late
    if done.returncode:
        why = done.stderr.strip() or f"its process ended with {done.returncode}"
        raise NotTypeset(f"Typst has refused {order[0]}: {why}")


@contextmanager
def workshop(scratch: Path | None) -> Iterator[Workshop]:
    """Open a folder in which a document is made, and delete it afterwards."""
    with temporary_folder("pdf-", scratch) as folder:
        shutil.copytree(_TEMPLATES, folder, dirs_exist_ok=True)
        yield Workshop(folder)


def _shown(data: Any) -> Any:
    """Return data with all texts cleaned."""
    if isinstance(data, str):
        return clean(data)
    if isinstance(data, Mapping):
        return {name: _shown(value) for name, value in data.items()}
    if isinstance(data, Sequence):
        return list(map(_shown, data))
    return data
