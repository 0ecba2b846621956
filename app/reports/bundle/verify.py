"""Checks an evidence bundle or a delivery from an untrusted source, and reports what is right and
what is wrong.

Nothing is unpacked to the disk, and only members that the manifest names are read.
"""

from __future__ import annotations

import base64
import hashlib
import re
import stat
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from app.errors import UnusableBundle
from app.imports.moved.zips import members_of
from app.reports.bundle.signed_archive import MANIFEST, SCHEMA, SIGNATURE, Manifest, Video
from app.reports.bundle.signing import fingerprint, is_signed_by

_MOST_MANIFEST_BYTES = 16 * 2**20
_MOST_BYTES = 64 * 2**30
"""Limit for all files together, unpacked."""
_MOST_FILES = 100_000
_NAME = re.compile(r"(?:[\w-][\w.-]*/)?[\w-][\w.-]*")
"""A file, or a file in a folder; of letters of any script, as films have such names."""
_BLOCK = 2**20


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    what: str
    is_right: bool | None
    """None if it was not checked."""
    detail: str


@dataclass(frozen=True)
class Verdict:
    """The results of all checks."""

    manifest: Manifest
    findings: tuple[Finding, ...]

    @property
    def is_right(self) -> bool:
        """Whether nothing is wrong."""
        return all(finding.is_right is not False for finding in self.findings)


def verify(bundle: Path, *, key: str | None = None, video: Path | None = None) -> Verdict:
    """Run all checks.

    Args:
        bundle: The ZIP.
        key: Fingerprint of the required signing key; None accepts any key.
        video: The film to compare with the one named in the manifest.

    Raises:
        UnusableBundle: The file is not a bundle, so nothing can be checked.
    """
    try:
        with zipfile.ZipFile(bundle) as archive:
            if sum(info.compress_size for info in members_of(archive)) > bundle.stat().st_size:
                raise UnusableBundle(f"{bundle} is not an evidence bundle: its files overlap.")
            _require_own_methods(archive)
            content = _only_member(archive, MANIFEST, _MOST_MANIFEST_BYTES)
            if content is None:
                raise UnusableBundle(f"It is not an evidence bundle: it must have one {MANIFEST}.")
            manifest = _manifest_of(content)
            findings = (
                *_signature(archive, manifest, content, key),
                *_files(archive, manifest),
                *_missing(manifest),
                *_videos(manifest, video),
            )
    except _MALFORMED as error:
        raise UnusableBundle(f"{bundle} is damaged or not an evidence bundle: {error}.") from error
    return Verdict(manifest, findings)


_MALFORMED = (
    zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError, zlib.error,
)  # fmt: skip
"""Errors of damaged, encrypted and foreign archives, which share no base class."""


def _require_own_methods(archive: zipfile.ZipFile) -> None:
    """Refuse other compression methods: bundles do not use them, they raise errors of their own,
    and LZMA may use any amount of memory.
    """
    for info in archive.infolist():
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise UnusableBundle(
                f"It is not an evidence bundle: {_shown(info.filename)} is compressed with a "
                "method that bundles do not use."
            )


def _only_member(archive: zipfile.ZipFile, name: str, most_bytes: int) -> bytes | None:
    """Return a member that is there once and not too large, else None."""
    infos = [info for info in archive.infolist() if info.filename == name]
    if len(infos) != 1 or infos[0].file_size > most_bytes:
        return None
    return archive.read(infos[0])


def _manifest_of(content: bytes) -> Manifest:
    try:
        manifest = msgspec.json.decode(content, type=Manifest)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise UnusableBundle(f"Its {MANIFEST} cannot be read: {error}.") from error
    if manifest.schema != SCHEMA:
        raise UnusableBundle(
            f"Its schema is {manifest.schema!r:.60}, and this Chainage knows {SCHEMA}. Check it "
            "with a newer version."
        )
    if len(manifest.files) > _MOST_FILES:
        raise UnusableBundle(f"Its {MANIFEST} names more than {_MOST_FILES} files.")
    return manifest


def _signature(
    archive: zipfile.ZipFile, manifest: Manifest, content: bytes, wanted: str | None
) -> Iterator[Finding]:
    public_key = _decoded(manifest.public_key)
    signature = _decoded(_only_member(archive, SIGNATURE, 1000) or b"")
    own = fingerprint(public_key)
    if not is_signed_by(public_key, signature, content):
        yield Finding("signature", False, f"{MANIFEST} is not the file that its key has signed")
        return
    yield Finding("signature", True, f"{MANIFEST} is unchanged since it was signed")
    if manifest.fingerprint != own:
        yield Finding("key", False, f"{MANIFEST} names another fingerprint than its key has")
    if wanted is None:
        yield Finding("key", None, "its owner was not checked: compare it, or name it (--key)")
    else:
        words = "it is the key that was named" if own == wanted else f"it is not {wanted}"
        yield Finding("key", own == wanted, words)


def _files(archive: zipfile.ZipFile, manifest: Manifest) -> Iterator[Finding]:
    """Report members that should not be in the archive, and check every listed file."""
    counts = Counter(info.filename for info in archive.infolist())
    infos = {info.filename: info for info in archive.infolist()}
    unlisted = [name for name in counts if name not in {*manifest.files, MANIFEST, SIGNATURE}]
    for name, count in counts.items():
        if count > 1:
            yield Finding(_shown(name), False, f"is {count} times in the archive")
    room = _MOST_BYTES
    for name in (*unlisted, *manifest.files):
        info, listed = infos.get(name), manifest.files.get(name)
        if not _NAME.fullmatch(name):
            yield Finding(_shown(name), False, "its name could lead out of a folder, or is odd")
        elif listed is None:
            yield Finding(name, False, f"is in the archive, but not in {MANIFEST}")
        elif info is None:
            yield Finding(name, False, "is missing in the archive")
        elif (fault := _fault_of(info)) is not None:
            yield Finding(name, False, fault)
        elif info.file_size != listed.size:
            yield Finding(name, False, f"has {info.file_size} bytes, and should have {listed.size}")
        elif listed.size > room:
            yield Finding(name, False, "is not read: all files together are too large")
        else:
            room -= listed.size
            yield _read(archive, info, listed.sha256)


def _fault_of(info: zipfile.ZipInfo) -> str | None:
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG) or info.is_dir():
        return "is a link or a folder, not a file"
    if info.flag_bits & 1:
        return "is encrypted"
    return None


def _read(archive: zipfile.ZipFile, info: zipfile.ZipInfo, sha256: str) -> Finding:
    digest, size = hashlib.sha256(), 0
    try:
        with archive.open(info) as file:
            while block := file.read(_BLOCK):
                digest.update(block)
                size += len(block)
    except _MALFORMED as error:
        return Finding(info.filename, False, f"is damaged: {error}")
    if digest.hexdigest() != sha256 or size != info.file_size:
        return Finding(info.filename, False, "has changed: its SHA-256 differs")
    return Finding(info.filename, True, f"{size} bytes, as listed")


def _missing(manifest: Manifest) -> Iterator[Finding]:
    for name in manifest.missing:
        yield Finding(_shown(name), None, "was gone, or had changed, when the bundle was made")


def _videos(manifest: Manifest, video: Path | None) -> Iterator[Finding]:
    given = None
    if video is not None:
        with video.open("rb") as file:
            given = hashlib.file_digest(file, "sha256").hexdigest()
    films = [one.video for one in manifest.inspections] or [manifest.video]
    meant = [film for film in films if film.sha256 == given] or films
    for film in films:
        yield _video(film, video.name if video and film in meant else None, given)


def _video(listed: Video, name: str | None, given: str | None) -> Finding:
    what = f"video {_shown(listed.filename)}"
    if not listed.sha256:
        return Finding(what, None if name is None else False, "its SHA-256 was not known yet")
    if name is None:
        return Finding(what, None, "was not checked; name the film (--video)")
    if given == listed.sha256:
        return Finding(what, True, f"{name} is the film that was inspected")
    return Finding(what, False, f"{name} is another film: its SHA-256 differs")


def _decoded(text: str | bytes) -> bytes:
    try:
        return base64.b64decode(text.strip(), validate=True)
    except ValueError:
        return b""


def _shown(name: str) -> str:
    return name[:80] if name.isprintable() else repr(name[:80])
