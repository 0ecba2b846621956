"""A ZIP whose files are listed in a signed manifest.

`manifest.json` lists every file with its size and SHA-256, and the underlying films.
`manifest.json.sig` is the Ed25519 signature of its bytes (RFC 8032), in base64.
"""

from __future__ import annotations

import base64
import zipfile
from datetime import datetime
from importlib.metadata import version

import msgspec

from app.imports.moved.archive_manifest import Listed
from app.reports.bundle.listed_zip import ListedZip, encodable
from app.reports.bundle.signing import Signer, fingerprint
from app.reports.report import Report
from app.reports.text.legible import iso

SCHEMA = "chainage-bundle/1"
MANIFEST = "manifest.json"
SIGNATURE = "manifest.json.sig"


class Video(msgspec.Struct, frozen=True):
    """The film, which need not be in the archive."""

    filename: str
    size: int
    sha256: str
    """Empty during the recording."""


class Inspected(msgspec.Struct, frozen=True):
    """One inspection of an archive with several."""

    report_id: str
    name: str
    revision: int
    folder: str
    video: Video


class Manifest(msgspec.Struct, frozen=True):
    """The content of an archive, and its inspection."""

    schema: str
    program: str
    report_id: str
    """Empty in an archive with several inspections, like the film's name."""
    name: str
    revision: int
    made_at: str
    video: Video
    public_key: str
    """32 bytes in base64; only its fingerprint, known from elsewhere, proves whose key it is."""
    fingerprint: str
    files: dict[str, Listed]
    missing: list[str]
    """Photos and voice notes that are named but no longer exist as they were stored."""
    inspections: list[Inspected] = []
    """Those of an archive with several."""
    not_made: dict[str, str] = {}
    """Formats that this inspection does not allow, by their names, and why."""


class SignedArchive(ListedZip):
    """An archive that is being written; `seal` ends it."""

    def __init__(self, archive: zipfile.ZipFile, made_at: datetime, signer: Signer) -> None:
        super().__init__(archive, made_at)
        self._signer = signer
        self.not_made: dict[str, str] = {}

    def seal(self, *reports: Inspected) -> None:
        """Add manifest and signature: of one inspection at the top, or of several in folders."""
        several = len(reports) != 1 or reports[0].folder != ""
        first = Inspected("", "", 0, "", Video("", 0, "")) if several else reports[0]
        key = self._signer.public_key
        manifest = Manifest(
            schema=SCHEMA,
            program=f"chainage {version('chainage')}",
            report_id=first.report_id,
            name=first.name,
            revision=first.revision,
            made_at=iso(self.made_at) or "",
            video=first.video,
            public_key=base64.b64encode(key).decode(),
            fingerprint=fingerprint(key),
            files=self.files,
            missing=self.missing,
            inspections=list(reports) if several else [],
            not_made=self.not_made,
        )
        content = msgspec.json.format(msgspec.json.encode(manifest), indent=1)
        self.write(MANIFEST, [content])
        self.write(SIGNATURE, [base64.b64encode(self._signer.sign(content)) + b"\n"])


def inspected(report: Report, folder: str = "") -> Inspected:
    """Return how a manifest names an inspection and its film."""
    source = report.source
    video = Video(encodable(source.filename), source.size, source.sha256)
    return Inspected(report.id, encodable(report.name), report.revision, folder, video)
