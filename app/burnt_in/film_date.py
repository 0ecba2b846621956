"""Reads the date that a recorder has burnt into a film."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from datetime import date

from app.burnt_in.box import Box
from app.burnt_in.finder import Read
from app.burnt_in.text_model import Letter
from vo_core.types import ByteImage

LEAST_SURE = 0.8
"""Least probability of each character of a date."""

LEAST_PICTURES = 2
"""A date is believed if so many pictures show it; one may be of the past or misread."""

FIRST_YEAR = 1990
"""Earlier films were not digital, and a wrong clock often begins at 1970 or 1980."""

_YEAR_FIRST = re.compile(r"(?<!\d)(\d{4})([-/.])(\d{1,2})\2(\d{1,2})(?!\d)")
_YEAR_LAST = re.compile(r"(?<!\d)(\d{1,2})([-/.])(\d{1,2})\2(\d{4})(?!\d)")


def shown_date(
    pictures: Sequence[ByteImage], lines: Sequence[Sequence[Box]], read: Read
) -> date | None:
    """Return the date that most pictures of a film show; None if there is none.

    Args:
        pictures: (H, W, 3) BGR each, from the whole film.
        lines: The lines of text in each picture.
        read: Reads a line of text.
    """
    found: Counter[date] = Counter()
    for picture, boxes in zip(pictures, lines, strict=True):
        texts = (read(box.cut_from(picture)) for box in boxes)
        found.update({day for text in texts if (day := date_in(text)) is not None})
    if not found:
        return None
    (day, times), *others = found.most_common(2)
    is_clear = not others or others[0][1] < times
    return day if times >= LEAST_PICTURES and is_clear else None


def date_in(letters: Sequence[Letter]) -> date | None:
    """Return the date in a line of text, if it is certain; 03/04/2019 may be in March or April."""
    text = "".join(letter.best for letter in letters)
    match = _YEAR_FIRST.search(text) or _YEAR_LAST.search(text)
    if match is None:
        return None
    if min(letter.sure for letter in letters[match.start() : match.end()]) < LEAST_SURE:
        return None
    first, _, second, third = match.groups()
    if len(first) == 4:
        orders = {(int(first), int(second), int(third))}
    else:
        orders = {(int(third), int(second), int(first))}
        if match[2] != ".":  # only with points does the day always come first
            orders.add((int(third), int(first), int(second)))
    days = set()
    for order in orders:
        with suppress(ValueError):  # there is no such day
            days.add(date(*order))
    day = days.pop() if len(days) == 1 else None
    return day if day is not None and day.year >= FIRST_YEAR else None
