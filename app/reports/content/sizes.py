"""What was measured on the wall: figures in words, and lines to draw on a photo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from app.reports.report import Entry, Photo
from app.survey.places.measure import Figure
from app.survey.rounding import with_interval

_UNITS = {"area": "mm²"}


@dataclass(frozen=True)
class Outline:
    """The clicks of a measure on the photo."""

    points: tuple[tuple[float, float], ...]
    """Shares of the picture's width and height, from its upper left corner."""
    is_closed: bool


def figure_text(figure: Figure) -> str:
    """Format `23 ± 2 mm`, of a depth with its share of the diameter: `42 ± 3 mm (14 ± 1 %)`."""
    size = f"{with_interval(figure.value, figure.u95)} {_UNITS.get(figure.kind, 'mm')}"
    if figure.percent is None or figure.percent_u95 is None:
        return size
    return f"{size} ({with_interval(figure.percent, figure.percent_u95)} %)"


def outlines(entry: Entry, photo: Photo, video: Mapping[str, Any]) -> list[Outline]:
    """Return the measures that were clicked in the frame of the photo.

    There are none for a photo of another frame, nor for a drawing, which may lie over the same
    place.

    Args:
        entry: The entry with the photo.
        photo: One of its photos.
        video: The film with its `width` and `height`, px, and `pixel_aspect`; pixel centres are at
            integers.
    """
    if photo.of not in ("", entry.id):
        return []
    wide, high = video["width"], video["height"]
    from vo_core.sources import square_size  # loads the codecs

    photo_wh = square_size((wide, high), video.get("pixel_aspect", 1.0))
    share = photo.marked.picture_share(*photo_wh) if photo.marked else 1.0
    measures: list[Mapping[str, Any]] = entry.tag.measures or []  # type: ignore[assignment]
    return [
        Outline(
            tuple(
                ((u + 0.5) / wide, share * (v + 0.5) / high)
                for u, v in (point["pixel"] for point in measure["points"])
            ),
            measure["kind"] == "area",
        )
        for measure in measures
        if all(point["frame"] == entry.tag.frame for point in measure["points"])
    ]
