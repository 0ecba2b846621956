"""The photos of a report, with captions that state defect and place."""

from __future__ import annotations

from typing import Any

from app.reports.content.pictures import jpeg_of, why_not_shown
from app.reports.content.shown_photos import ShownPhoto
from app.reports.content.translator import Translator
from app.reports.pdf.typesetter import Workshop
from app.reports.report import Entry, Photo, Report

ENOUGH_PX = 640
"""Pixels for 200 dpi in print."""
_MOST_CAPTIONS = 12


def photo_data(report: Report, photo: ShownPhoto, t: Translator, shop: Workshop) -> dict[str, Any]:
    """Return a photo with its captions; its picture goes into the workshop."""
    order = {entry.id: n for n, entry in enumerate(report.entries)}
    captions = photo.captions[:_MOST_CAPTIONS]
    entry, own = photo.captions[0]
    time_s = own.time_s(entry)
    rest = len(photo.captions) - len(captions)
    details = [*t.sizes(entry), t.clock_in_words(entry)] if len(photo.captions) == 1 else []
    return {
        "number": photo.number,
        "title": photo.name(t),
        "alt": " ".join(photo_alt(one, own, t) for one, own in captions),
        "captions": [
            {
                "entry": order[one.id],
                "text": t(
                    "photos.caption",
                    seq=one.number,
                    place=t.place_in_photo(one, own.taken),
                    code=t.code(one),
                ),
            }
            for one, own in captions
        ],
        "more": t("photos.more", n=rest) if rest else "",
        "time": t.time(time_s),
        "film": report.film_at(time_s),
        "details": [detail for detail in (*details, own.name) if detail],
        **picture_of(photo.photo, t, shop, photo),
    }


def picture_of(
    photo: Photo | None, t: Translator, shop: Workshop, shown: ShownPhoto | None = None
) -> dict[str, str | None]:
    """Return the file of a photo, or why there is none."""
    jpeg = jpeg_of(photo.shown, ENOUGH_PX) if photo else None
    if jpeg is not None:
        return {"file": shop.add_photo(jpeg, shown.lines if shown else ()), "reason": ""}
    reason = t(why_not_shown(photo), name=photo.name) if photo else t("photos.no_photo")
    return {"file": None, "reason": reason}


def photo_alt(entry: Entry, photo: Photo | None, t: Translator) -> str:
    """Say what a photo shows: defect, place and clock position."""
    place = t.place_in_photo(entry, photo.taken if photo else None)
    parts = (f"{t.code(entry)} {t.label(entry)}", place, t.clock_in_words(entry))
    return t("alt.photo", seq=entry.number, shown=", ".join(part for part in parts if part))
