"""The parameters of a page of features, by OGC API Features Part 1 (17-069r4)."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from dataclasses import dataclass
from datetime import UTC, date, datetime
from typing import Any

from starlette.datastructures import QueryParams

from app.errors import InvalidQuery
from app.search.features import AFTER
from app.survey.assets.box import Box
from app.survey.assets.search_terms import FeatureFilter
from app.survey.given import LINE

MOST_FEATURES = 10_000
"""Of one page."""
_USUAL = 100
_LONGEST = 20_000
_INSTANT = re.compile(
    r"\d{4}-\d{2}-\d{2}([Tt ]\d{2}:\d{2}:\d{2}(\.\d{1,9})?([Zz]|[+-]\d{2}:\d{2}))?", re.ASCII
)
_OPEN = ("", "..")


def parameters(names: Collection[str]) -> list[dict[str, Any]]:
    """Return the parameters of these names as an OpenAPI document states them."""
    texts = {"type": "string", "maxLength": _LONGEST}
    numbers = {"type": "array", "minItems": 4, "maxItems": 6, "items": {"type": "number"}}
    pages = {"type": "integer", "minimum": 1, "maximum": MOST_FEATURES, "default": _USUAL}
    kinds = {
        "limit": (pages, "Features of a page."),
        "bbox": (numbers, "West, south, east, north in degrees (CRS84)."),
        "datetime": (texts, "Day, instant, or interval such as 2026-01-01/.. of the survey."),
        AFTER: (texts, "Begin behind this feature; taken from the link next."),
    }
    return [
        {
            "name": name,
            "in": "query",
            "required": False,
            "style": "form",
            "explode": False,
            "schema": kinds.get(name, (texts, ""))[0],
            "description": kinds.get(name, (texts, f"Whole {name} of the features."))[1],
        }
        for name in names
    ]


@dataclass(frozen=True)
class Query:
    """What a client wants of a collection."""

    wanted: FeatureFilter
    limit: int
    after: str | None


def parsed(given: QueryParams, names: Collection[str]) -> Query:
    """Read the parameters.

    Raises:
        InvalidQuery: One is unknown, given twice, or not understood.
    """
    require_known(given, names)
    first, last = _days(given["datetime"]) if "datetime" in given else (None, None)
    wanted = FeatureFilter(
        box=_box(given["bbox"]) if "bbox" in given else None,
        first=first,
        last=last,
        project=_text("project", given.get("project")),
        asset=_text("asset", given.get("asset")),
        code=_text("code", given.get("code")),
    )
    return Query(wanted, _limit(given.get("limit")), _text(AFTER, given.get(AFTER)))


def require_known(given: QueryParams, names: Collection[str] = ()) -> None:
    """Raise InvalidQuery if a parameter is unknown or given twice."""
    if strange := sorted({repr(name)[:60] for name in given if name not in names}):
        known = f"; known are {', '.join(names)}" if names else ""
        raise InvalidQuery(f"There is no parameter {', '.join(strange)} here{known}.")
    if len(given.multi_items()) > len(given):
        raise InvalidQuery("Give each parameter once.")


def _text(name: str, text: str | None) -> str | None:
    if text is not None and (len(text) > _LONGEST or not re.fullmatch(LINE, text)):
        raise InvalidQuery(f"{name} must be at most {_LONGEST} characters of one line.")
    return text


def _limit(text: str | None) -> int:
    if text is None:
        return _USUAL
    if not (text.isascii() and text.isdigit() and int(text[:20]) > 0):
        raise InvalidQuery(f"limit must be a whole number from 1, not {text!r:.60}.")
    return min(int(text[:20]), MOST_FEATURES)  # Part 1, 7.15.2: more is not an error


def _box(text: str) -> Box:
    """Read a box of four numbers, or of six with heights, which no feature has."""
    try:
        numbers = [float(part) for part in text.split(",", 7)]
    except ValueError:
        numbers = []
    if len(numbers) == 6:
        numbers = [*numbers[:2], *numbers[3:5]]
    if len(numbers) != 4 or not all(map(math.isfinite, numbers)):
        raise InvalidQuery(f"bbox must be four numbers, west,south,east,north; not {text!r:.60}.")
    box = Box(*numbers)
    lats, lons = (box.south, box.north), (box.west, box.east)
    if any(abs(lat) > 90 for lat in lats) or any(abs(lon) > 180 for lon in lons):
        raise InvalidQuery("bbox must be degrees: latitudes to 90, longitudes to 180.")
    if box.south > box.north:
        raise InvalidQuery("bbox begins with its south-west corner: its south lies beyond north.")
    return box


def _days(text: str) -> tuple[date | None, date | None]:
    """Return the first and the last day of an instant or interval; None where it is open."""
    parts = text.split("/", 2)
    if len(parts) == 1:
        return _day(text), _day(text)
    if len(parts) > 2 or all(part in _OPEN for part in parts):
        raise InvalidQuery("datetime must be an instant, or an interval with a beginning or end.")
    first, last = (None if part in _OPEN else _day(part) for part in parts)
    if first is not None and last is not None and first > last:
        raise InvalidQuery("datetime ends before it begins.")
    return first, last


def _day(text: str) -> date:
    # In its own form: Python takes others too, such as weeks.
    found = text.upper() if _INSTANT.fullmatch(text) else ""
    try:
        instant = datetime.fromisoformat(found)
        return (instant if instant.tzinfo is None else instant.astimezone(UTC)).date()
    except (ValueError, OverflowError) as error:
        raise InvalidQuery(
            f"datetime must be as 2026-01-31 or 2026-01-31T12:00:00Z, not {text!r:.60}."
        ) from error
