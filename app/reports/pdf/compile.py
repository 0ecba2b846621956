"""Runs Typst once; as a program, as ordered on standard input."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import typst

_ROUNDS = 11
"""Typst forgets what it has kept of a document when it has set so many others."""


def compile_pdf(template: Path, out: Path, font_folders: Sequence[str], made_at_s: int) -> None:
    """Set a document as PDF/UA-1 and PDF/A-2a.

    Args:
        template: The main file, beside all that it reads.
        out: The file to be written.
        font_folders: Where fonts are looked for.
        made_at_s: Date of the file, in seconds since 1970.

    Raises:
        TypstError: The document breaks a rule of the standards, or a template has a fault.
    """
    fonts = typst.Fonts(
        include_system_fonts=False, include_embedded_fonts=False, font_paths=list(font_folders)
    )
    typst.compile(
        str(template),
        str(out),
        root=str(template.parent),
        font_paths=fonts,
        timestamp=made_at_s,
        pdf_standards=["ua-1", "a-2a"],
    )


def forget() -> None:
    """Free what Typst has kept, of which a server would have 150 MB after some reports."""
    fonts = typst.Fonts(include_system_fonts=False, include_embedded_fonts=False)
    for _ in range(_ROUNDS):
        typst.compile(b"", font_paths=fonts)


def main() -> int:
    """Write the PDF; return 1 and say why on standard error if Typst refuses the document."""
    template, out, font_folders, made_at_s = json.load(sys.stdin)
    try:
        compile_pdf(Path(template), Path(out), font_folders, made_at_s)
    except typst.TypstError as error:
        print(error.diagnostic or error.message, file=sys.stderr)  # noqa: T201
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
