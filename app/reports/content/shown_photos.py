"""The pictures that reports show: one that several observations share is shown once, for all."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

from app.reports.content.sizes import Outline, outlines
from app.reports.report import Entry, Photo, Report


@dataclass(frozen=True)
class ShownPhoto:
    """A picture with every observation that it is a photo of."""

    photo: Photo
    """What to show; its burnt-in caption has a line for each observation."""
    captions: tuple[tuple[Entry, Photo], ...]
    """The observations in the order of the report, each with its own photo of this picture."""
    lines: tuple[Outline, ...]
    """What was measured on it."""


def shown_photos(report: Report) -> list[ShownPhoto]:
    """Return the pictures in the order of the report; photos without a file are left out.

    Photos are the same picture if their files are equal (of a file without a hash: if they show the
    same frame of the film) and carry the same drawing.
    """
    alike: dict[Hashable, list[tuple[Entry, Photo]]] = {}
    for entry in report.entries:
        for photo in entry.photos:
            if photo.jpeg is not None:
                found = alike.setdefault(_picture(entry, photo), [])
                if all(other is not entry for other, _ in found):
                    found.append((entry, photo))
    return [_shown(tuple(found), report) for found in alike.values()]


def _picture(entry: Entry, photo: Photo) -> Hashable:
    drawn = photo.marked.drawn if photo.marked else ""
    if photo.sha256:
        return photo.sha256, drawn
    is_own = photo.of in ("", entry.id)
    return entry.tag.frame if is_own else photo.of, drawn


def _shown(captions: tuple[tuple[Entry, Photo], ...], report: Report) -> ShownPhoto:
    photo = captions[0][1]
    if photo.marked and photo.marked.caption:
        written = [own.marked.caption for _, own in captions if own.marked and own.marked.caption]
        photo = replace(photo, marked=replace(photo.marked, caption="\n".join(written)))
    lines = [
        line
        for entry, own in captions
        for line in outlines(entry, replace(own, marked=photo.marked), report.source.video)
    ]
    return ShownPhoto(photo, captions, tuple(lines))
