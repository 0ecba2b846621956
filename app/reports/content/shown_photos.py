"""The pictures that reports show: one that several observations share is shown once, for all."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

from app.reports.content.sizes import Outline, outlines
from app.reports.content.translator import Translator
from app.reports.report import Entry, Photo, Report


@dataclass(frozen=True)
class ShownPhoto:
    """A picture with every observation that it is a photo of."""

    number: int
    """From 1, in the order of the report."""
    photo: Photo
    """What to show; its burnt-in caption has a line for each observation."""
    captions: tuple[tuple[Entry, Photo], ...]
    """The observations in the order of the report, each with its own photo of this picture."""
    lines: tuple[Outline, ...]
    """What was measured on it."""

    def name(self, t: Translator) -> str:
        """Return `Photo 3`, or `Drawing 3` where a person has drawn on a copy."""
        is_drawing = self.photo.marked is not None and self.photo.marked.strokes
        return t("photos.drawing" if is_drawing else "photos.photo", n=self.number)


def photo_alt(entry: Entry, photo: Photo, t: Translator) -> str:
    """Say what a photo shows, for people who do not see it."""
    place = t.place_in_photo(entry, photo.taken)
    return t("web.photo", seq=entry.number, label=t.label(entry), place=place)


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
    return [_shown(number, found, report) for number, found in enumerate(alike.values(), 1)]


def photos_by_entry(shown: Sequence[ShownPhoto]) -> Mapping[str, Sequence[ShownPhoto]]:
    """Return the pictures of each observation by its id."""
    found: dict[str, list[ShownPhoto]] = defaultdict(list)
    for one in shown:
        for entry, _ in one.captions:
            found[entry.id].append(one)
    return found


def _picture(entry: Entry, photo: Photo) -> Hashable:
    drawn = photo.marked.drawn if photo.marked else ""
    if photo.sha256:
        return photo.sha256, drawn
    is_own = photo.of in ("", entry.id)
    return entry.tag.frame if is_own else photo.of, drawn


def _shown(number: int, captions: Sequence[tuple[Entry, Photo]], report: Report) -> ShownPhoto:
    photo = captions[0][1]
    if photo.marked and photo.marked.caption:
        written = [own.marked.caption for _, own in captions if own.marked and own.marked.caption]
        photo = replace(photo, marked=replace(photo.marked, caption="\n".join(written)))
    lines = [
        line
        for entry, own in captions
        for line in outlines(entry, replace(own, marked=photo.marked), report.source.video)
    ]
    return ShownPhoto(number, photo, tuple(captions), tuple(lines))
