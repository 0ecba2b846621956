"""The evidence bundle: every format of the report, photos, voice notes, clips and tracks, with a
signed manifest.

`manifest.json` lists every file with its size and SHA-256, and the underlying video.
`manifest.json.sig` is the Ed25519 signature of its bytes (RFC 8032), in base64.
"""

from __future__ import annotations

import base64
import hashlib
import stat
import tempfile
import zipfile
from collections.abc import Mapping
from datetime import UTC
from importlib.metadata import version
from typing import IO, Protocol, cast

import msgspec

from app.errors import ExportNotAvailable
from app.reports.bundle.signing import fingerprint
from app.reports.content.naming import file_stem
from app.reports.report import Entry, Loss, Photo, Report, VoiceNote, Written, failure
from app.reports.tables.table import iso
from app.storage.blobs import Readable
from vo_core import Track
from vo_core.errors import ChainageError

SCHEMA = "chainage-bundle/1"
MANIFEST = "manifest.json"
SIGNATURE = "manifest.json.sig"
PHOTOS, VOICE, CLIPS = "photos/", "voice/", "clips/"
MARKED = "-marked"
"""End of the stem of a copy with marks; the photo as it was taken is beside it."""

_STORED = (".jpg", ".pdf", ".xlsx", ".webm", ".ogg", ".m4a", ".mp4")
"""Stored uncompressed: these formats hardly shrink."""


class Form(Protocol):
    """A format of the report."""

    @property
    def stem(self) -> str:
        """Stem of the file's name."""

    @property
    def suffix(self) -> str:
        """Suffix of the file's name, with the dot."""

    def write(self, report: Report, /) -> Written:
        """Return the report in this format."""


class Listed(msgspec.Struct, frozen=True):
    """One file of a bundle."""

    size: int
    sha256: str


class Video(msgspec.Struct, frozen=True):
    """The film, which is not in the bundle."""

    filename: str
    size: int
    sha256: str
    """Empty during the recording."""


class Manifest(msgspec.Struct, frozen=True):
    """The content of a bundle, and its inspection."""

    schema: str
    program: str
    report_id: str
    name: str
    revision: int
    made_at: str
    video: Video
    public_key: str
    """32 bytes in base64; only its fingerprint, known from elsewhere, proves whose key it is."""
    fingerprint: str
    files: dict[str, Listed]
    missing: list[str]
    """Photos and voice notes that are named but no longer exist."""


def write(report: Report, forms: Mapping[str, Form]) -> Written:
    """Write a ZIP to a temporary file, so that many photos need no memory.

    Raises:
        ExportNotAvailable: There is no signing key, or a format lacks what it needs.
    """
    if report.signer is None:
        raise ExportNotAvailable("There is no key with which the bundle could be signed.")
    file = cast(IO[bytes], tempfile.TemporaryFile())  # noqa: SIM115  (handed on open)
    try:
        with zipfile.ZipFile(file, "w") as archive:
            bundle = _Bundle(archive, report)
            for kind, form in forms.items():
                bundle.add_form(kind, form)
            bundle.add_track("track.csv", report.track, raw=False)
            bundle.add_track("track-raw.csv", report.raw_track, raw=True)
            bundle.add_photos()
            bundle.add_voice_notes()
            bundle.add_clips()
            manifest = msgspec.json.format(msgspec.json.encode(bundle.manifest()), indent=1)
            bundle.add(MANIFEST, manifest)
            bundle.add(SIGNATURE, base64.b64encode(report.signer.sign(manifest)) + b"\n")
    except BaseException:
        file.close()
        raise
    file.seek(0)
    return Written(b"", tuple(bundle.losses), file)


class _Bundle:
    """An archive that is being written, and the list of its files."""

    def __init__(self, archive: zipfile.ZipFile, report: Report) -> None:
        self._archive = archive
        self._report = report
        self._files: dict[str, Listed] = {}
        self._missing: list[str] = []
        self.losses: list[Loss] = []

    def add_form(self, kind: str, form: Form) -> None:
        """Add the report in one of its formats."""
        written = form.write(self._report)
        self._note(f"{form.stem}{form.suffix}", b"".join(written.blocks()))
        self.losses += [
            Loss("in_format", loss.entry, format=kind, loss=loss) for loss in written.losses
        ]

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
        self._note(name, track.to_csv(metadata).encode("utf-8", "replace"))

    def add_photos(self) -> None:
        """Add the photos as they were taken, under the names used in the tables, and marked copies
        of them.
        """
        for entry in self._report.entries:
            for photo in entry.photos:
                if photo.jpeg is None:
                    self.losses.append(Loss("photo_elsewhere", entry, name=photo.name))
                    continue
                is_there = self._add_stored("photo", PHOTOS, photo, photo.jpeg, entry)
                if is_there and photo.marked is not None:
                    name = photo.name.removesuffix(".jpg") + f"{MARKED}.jpg"
                    self._note(PHOTOS + name, photo.marked.read_bytes())

    def add_voice_notes(self) -> None:
        """Add what people said."""
        for entry in self._report.entries:
            for note in entry.voice_notes:
                self._add_stored("voice", VOICE, note, note.sound, entry)

    def add_clips(self) -> None:
        """Add the clip around each entry, if they are asked for."""
        clip_of = self._report.extras.clip_of
        if clip_of is None:
            return
        stem = file_stem(self._report.asset)
        for entry in self._report.entries:
            try:
                clip = clip_of(entry.id)
            except ChainageError as error:
                self.losses.append(Loss("no_clip", entry, reason=failure(error)))
                continue
            self._note(f"{CLIPS}{stem}-{entry.seq:03d}.mp4", clip)

    def _add_stored(
        self, what: str, folder: str, named: Photo | VoiceNote, stored: Readable, entry: Entry
    ) -> bool:
        """Add a stored file; return whether it is there. One that has changed is reported."""
        name, sha256 = named.name, named.sha256
        path = folder + name
        try:
            content = stored.read_bytes()
        except FileNotFoundError:
            self._missing.append(path)
            self.losses.append(Loss(f"{what}_gone", entry, name=name))
            return False
        self._note(path, content)
        if sha256 is not None and self._files[path].sha256 != sha256:
            self.losses.append(Loss(f"{what}_changed", entry, name=name))
        return True

    def manifest(self) -> Manifest:
        """Return the manifest of the files added so far."""
        report, source = self._report, self._report.source
        key = report.signer.public_key if report.signer else b""
        return Manifest(
            schema=SCHEMA,
            program=f"chainage {version('chainage')}",
            report_id=report.id,
            name=_encodable(report.name),
            revision=report.revision,
            made_at=iso(report.made_at) or "",
            video=Video(_encodable(source.filename), source.size, source.sha256),
            public_key=base64.b64encode(key).decode(),
            fingerprint=fingerprint(key),
            files=self._files,
            missing=self._missing,
        )

    def add(self, name: str, content: bytes) -> None:
        """Add a file that the manifest does not list."""
        self._archive.writestr(self._info(name), content)

    def _note(self, name: str, content: bytes) -> None:
        self.add(name, content)
        self._files[name] = Listed(len(content), hashlib.sha256(content).hexdigest())

    def _info(self, name: str) -> zipfile.ZipInfo:
        """Describe a plain file with the time of the report: equal reports give equal archives."""
        made_at = self._report.made_at.astimezone(UTC)
        info = zipfile.ZipInfo(name, (max(made_at.year, 1980), *made_at.timetuple()[1:6]))
        info.create_system = 3
        info.external_attr = (stat.S_IFREG | 0o644) << 16
        is_stored = name.endswith(_STORED)
        info.compress_type = zipfile.ZIP_STORED if is_stored else zipfile.ZIP_DEFLATED
        return info


def _encodable(text: str) -> str:
    return text.encode("utf-8", "replace").decode()
