"""The names of photos and films at the top of a delivery, which its exchange file cites.

Exchange formats cite names without a folder, so that those of all inspections share one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from app.reports.exchange.names import film, film_in_ascii
from app.reports.report import Photo, Report
from app.reports.text.naming import file_stem

_ASCII = ("en13508", "en13508xml", "ribx")
"""Formats whose names of films are in ASCII."""


class CitedNames:
    """Names that are taken; another case of letters does not make another name."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = {name.casefold(): "" for name in taken}
        """Each with the checksum of the film that it names."""

    def with_unique_names(self, report: Report, kind: str, number: int) -> Report:
        """Return the report with names of photos and film that no other inspection has.

        A name that is taken gets the number of the inspection in the delivery before it, and the
        culvert if it does not begin with it: `002-CUL-0041-001.jpg`.

        Args:
            report: The report of the inspection.
            number: Its number in the delivery.
            kind: Name of the exchange format, on which the letters of a film's name depend.
        """
        stem = file_stem(report.asset)

        def own(name: str, content: str = "") -> str:
            begins = name.casefold().startswith(stem.casefold())
            before = f"{number:03d}-" if begins else f"{number:03d}-{stem}-"
            return self.unique(name, before, content)

        photos = [photo for entry in report.entries for photo in entry.photos]
        names = {name: own(name) for name in dict.fromkeys(photo.name for photo in photos)}

        def renamed(photo: Photo) -> Photo:
            return replace(photo, name=names[photo.name])

        entries = tuple(
            replace(
                entry,
                photo=renamed(entry.photo) if entry.photo else None,
                more_photos=tuple(map(renamed, entry.more_photos)),
            )
            for entry in report.entries
        )
        called = (film_in_ascii if kind in _ASCII else film)(report)
        called = called and own(called, report.source.sha256)
        extras = replace(report.extras, film_called=called)
        return replace(report, entries=entries, extras=extras)

    def unique(self, name: str, before: str, content: str = "") -> str:
        """Return a unique name by prefixing `before`, and take it.

        Args:
            name: The wanted name.
            before: What makes it another one.
            content: Checksum of the film that it names: the same film keeps its name.
        """
        while (found := self._taken.get(name.casefold())) is not None:
            if content and found == content:
                break
            name = before + name
        self._taken[name.casefold()] = content
        return name
