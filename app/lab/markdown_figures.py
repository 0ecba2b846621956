"""Writes measured figures into a Markdown file, between two comments:

<!-- NAME:begin -->
the figures
<!-- NAME:end -->
"""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path


def replace_figures(text: str, name: str, figures: str) -> str:
    """Replace the figures between the markers of a name; the rest of the text is kept.

    Raises:
        ValueError: The text does not contain both markers once each, in this order.
    """
    begin, end = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
    if (text.count(begin), text.count(end)) != (1, 1) or text.index(begin) > text.index(end):
        raise ValueError(f"needs {begin} and, after it, {end}, once each")
    between = re.compile(f"(?<={re.escape(begin)}).*(?={re.escape(end)})", re.DOTALL)
    return between.sub(lambda _: f"\n{figures.strip()}\n", text)


def write_figures(file: Path, name: str, command: str, figures: str) -> None:
    """Write figures, today's date and their command between the markers of a file.

    Raises:
        ValueError: As `replace_figures` does; the file is unchanged.
    """
    stated = f"Measured on {date.today():%d %B %Y} by `{command}`.\n\n{figures}"
    text = replace_figures(file.read_text(encoding="utf-8"), name, stated)
    file.write_text(text, encoding="utf-8")
