"""The evidence bundle: every format of the report, exchange files, photos, voice notes, clips and
tracks, with a signed manifest.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping

from app.errors import ExportNotAvailable
from app.reports.bundle.listed_zip import written_to_disk
from app.reports.bundle.signed_archive import SignedArchive, inspected
from app.reports.format import Format
from app.reports.report import Entry, Loss, Report, Written, failure, format_name
from app.reports.text.naming import file_stem
from app.storage.blobs.blobs import Readable
from vo_core import Track
from vo_core.errors import ChainageError

PHOTOS, VOICE, CLIPS = "photos/", "voice/", "clips/"
EXCHANGE = "exchange/"
MOST_CLIPS = 200
"""Clips of one bundle: each takes seconds to cut."""
MARKED = "-marked"
"""End of the stem of a copy with marks; the photo as it was taken is beside it."""


def write(report: Report, forms: Mapping[str, Format], exchange: Mapping[str, Format]) -> Written:
    """Write the bundle as a ZIP.

    Args:
        report: The report.
        forms: Formats that every inspection allows, by their names.
        exchange: Formats of other programs: one that lacks something is named as not made.

    Raises:
        ExportNotAvailable: There is no signing key, or a format lacks what it needs.
    """
    signer = report.signer
    if signer is None:
        raise ExportNotAvailable("There is no key with which the bundle could be signed.")

    def fill(archive: zipfile.ZipFile) -> list[Loss]:
        bundle = _Bundle(SignedArchive(archive, report.made_at, signer), report)
        for kind, form in forms.items():
            bundle.add_form(kind, form)
        for kind, form in exchange.items():
            bundle.add_exchange(kind, form)
        bundle.add_track("track.csv", report.track, raw=False)
        bundle.add_track("track-raw.csv", report.raw_track, raw=True)
        bundle.add_photos()
        bundle.add_voice_notes()
        bundle.add_clips()
        bundle.archive.seal(inspected(report))
        return bundle.losses

    return written_to_disk(report.scratch, fill)


class _Bundle:
    """An archive that is being written, and what it lacks."""

    def __init__(self, archive: SignedArchive, report: Report) -> None:
        self.archive = archive
        self._report = report
        self.losses: list[Loss] = []

    def add_form(self, kind: str, form: Format) -> None:
        """Add the report in one of its formats."""
        self.losses += [loss.in_format(kind) for loss in self._add(form, "")]

    def add_exchange(self, kind: str, form: Format) -> None:
        """Add the file of another program's format, or name it as not made.

        What it cannot hold is no loss of the bundle, whose other files have it.
        """
        try:
            self._add(form, EXCHANGE)
        except ChainageError as error:
            self.archive.not_made[kind] = str(error)
            self.losses.append(Loss("not_made", format=format_name(kind), reason=failure(error)))

    def _add(self, form: Format, folder: str) -> tuple[Loss, ...]:
        written = form.write(self._report)
        self.archive.add(f"{folder}{form.stem}{form.suffix}", written.blocks())
        return written.losses

    def add_track(self, name: str, track: Track, *, raw: bool) -> None:
        """Add a track as the API returns it, with comments about its origin."""
        report = self._report
        metadata: dict[str, object] = {
            "inspection": report.id,
            "name": report.name,
            "video": report.source.filename,
            "video_sha256": report.source.sha256,
        }
        if report.adjusted and not raw:
            metadata |= report.adjusted.metadata()
        self.archive.add(name, [track.to_csv(metadata).encode("utf-8", "replace")])

    def add_photos(self) -> None:
        """Add the photos as they were taken, under the names used in the tables, and marked copies
        of them.
        """
        for entry in self._report.entries:
            for photo in entry.photos:
                stored = photo.original
                if stored is None:
                    self.losses.append(Loss("photo_elsewhere", entry, name=photo.name))
                    continue
                is_there = self._add_stored("photo", PHOTOS, photo.name, stored, entry)
                if is_there and photo.marked is not None:
                    name = photo.name.removesuffix(".jpg") + f"{MARKED}.jpg"
                    self.archive.add(PHOTOS + name, [photo.marked.read_bytes()])

    def add_voice_notes(self) -> None:
        """Add what people said."""
        for entry in self._report.entries:
            for note in entry.voice_notes:
                self._add_stored("voice", VOICE, note.name, note.original, entry)

    def add_clips(self) -> None:
        """Add the clip around each entry, if they are asked for; of too many the severest."""
        clip_of = self._report.extras.clip_of
        if clip_of is None:
            return
        stem = file_stem(self._report.asset)
        if (count := len(self._report.entries)) > MOST_CLIPS:
            self.losses.append(Loss("too_many_clips", most=MOST_CLIPS, count=count))
        for entry in _severest(self._report):
            try:
                clip = clip_of(entry.id)
            except ChainageError as error:
                self.losses.append(Loss("no_clip", entry, reason=failure(error)))
                continue
            self.archive.add(f"{CLIPS}{stem}-{entry.seq:03d}.mp4", [clip])

    def _add_stored(
        self, what: str, folder: str, name: str, stored: Readable, entry: Entry
    ) -> bool:
        """Add a stored file; return whether it is there. One that has changed is no evidence."""
        why = self.archive.add_stored(folder + name, stored)
        if why is not None:
            self.losses.append(Loss(f"{what}_{why}", entry, name=name))
        return why is None


def _severest(report: Report) -> list[Entry]:
    ranked = sorted(report.entries, key=lambda entry: -(entry.tag.severity or 0))
    kept = {entry.id for entry in ranked[:MOST_CLIPS]}
    return [entry for entry in report.entries if entry.id in kept]
