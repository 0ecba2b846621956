"""Reads an archive file, which nobody has checked; only for a child process with limits.

Nothing is unpacked: what is stored as it is gets read from its place in the file afterwards, so a
name in the ZIP never becomes a path. Every file is compared with the manifest here, but for the
film, which may have 20 GB: who stores it compares it on the way, so that it is read once.
"""

from __future__ import annotations

import hashlib
import re
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import msgspec

from app.errors import InvalidImport, InvalidPack
from app.imports.moved import chainage_json
from app.imports.moved.archive_manifest import (
    COMPRESSED,
    FILM,
    MANIFEST,
    PACK,
    REPORT,
    SCHEMA,
    VOICE,
    Listed,
    Manifest,
    not_as_listed,
)
from app.imports.moved.moved_media import require_media
from app.imports.moved.whole_inspection import MovedFile, WholeInspection
from app.imports.moved.zips import members_of
from app.survey.catalogue.read import read_table

MIB = 2**20
MOST_FILES = 100_000
"""Most files: photos of 20,000 defects, and the wall of some kilometres."""
_MOST_TEXT_BYTES = 64 * MIB
_BLOCK = 4 * MIB
_EXPECTED = re.compile(
    r"manifest\.json|inspection\.json|counter\.json|counter\.csv|parts\.csv|code-pack\.csv"
    r"|photos/[A-Za-z0-9_.-]{1,150}\.jpg|voice/[A-Za-z0-9_.-]{1,150}\.(webm|ogg|m4a)"
    r"|wall/-?[0-9]{1,9}\.jpg|film/video\.[a-z0-9]{1,4}"
)
_LOCAL_HEAD = struct.Struct("<4s22xHH")
"""Of a file in a ZIP: signature, then the lengths of its name and of the extra field."""
_ENCRYPTED = 1
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    NotImplementedError,
    UnicodeDecodeError,  # a name that is not in UTF-8
    OverflowError,  # a place far beyond the file
)
"""How `zipfile` fails at a file that is no ZIP, or damaged."""


def read(path: Path) -> WholeInspection:
    """Check an archive file strictly and return its inspection, with the places of its files.

    Raises:
        InvalidImport: It is no whole archive file of Chainage; the text says what is wrong.
    """
    try:
        with path.open("rb") as file, zipfile.ZipFile(file) as archive:
            return _Reader(file, archive).inspection()
    except _DAMAGED as error:
        raise InvalidImport(
            f"The file is no ZIP, or was cut off or damaged on its way: {error}."
        ) from error


class _Reader:
    def __init__(self, file: BinaryIO, archive: zipfile.ZipFile) -> None:
        self._file = file
        self._archive = archive
        self._members = _members(archive)

    def inspection(self) -> WholeInspection:
        manifest = self._manifest()
        self._require_listed(manifest)
        files = {}
        taken: list[tuple[int, int]] = []
        for name, listed in manifest.files.items():
            files[name] = self._checked(name, listed)
            if (at := files[name].at) is not None:
                taken.append((at, at + listed.size))
        _require_apart(taken)
        report = files.pop(REPORT, None)
        if report is None or report.content is None:
            raise InvalidImport(f"The archive file has no {REPORT}.")
        inspection = chainage_json.read(report.content)
        if inspection.files:
            raise InvalidImport(f"{REPORT} contains photos, which belong beside it.")
        _require_film_of(inspection, files)
        _require_codes(inspection, files)
        return replace(inspection, files=files)

    def _manifest(self) -> Manifest:
        if MANIFEST not in self._members:
            raise InvalidImport("The ZIP is no archive file of Chainage: it has no manifest.json.")
        content = b"".join(self._blocks(MANIFEST))
        try:
            manifest = msgspec.json.decode(content, type=Manifest)
        except msgspec.MsgspecError as error:
            raise InvalidImport(f"The ZIP is no archive file of Chainage: {error}.") from error
        if manifest.schema != SCHEMA:
            raise InvalidImport(
                f"The ZIP is no archive file that this Chainage reads: its schema is "
                f"{manifest.schema!r:.60}, not {SCHEMA}."
            )
        return manifest

    def _require_listed(self, manifest: Manifest) -> None:
        found, listed = self._members.keys() - {MANIFEST}, manifest.files.keys()
        if more := sorted(found - listed):
            raise InvalidImport(f"The manifest does not list {more[0]!r}.")
        if missing := sorted(listed - found):
            raise InvalidImport(f"The archive file lacks {missing[0]!r:.200}.")

    def _checked(self, name: str, listed: Listed) -> MovedFile:
        """Compare a file with the manifest, and check what it is; of the film only the size."""
        member = self._members[name]
        if name.startswith(FILM):
            if member.file_size != listed.size:
                raise InvalidImport(not_as_listed(name))
            return MovedFile(listed.size, listed.sha256, at=self._place(member))
        is_whole = name.endswith((".jpg", *COMPRESSED)) or name.startswith(VOICE)
        digest, size, whole = hashlib.sha256(), 0, bytearray()
        for block in self._blocks(name):
            digest.update(block)
            size += len(block)
            if is_whole:
                whole += block
        if (size, digest.hexdigest()) != (listed.size, listed.sha256):
            raise InvalidImport(not_as_listed(name))
        if name.endswith(COMPRESSED):
            return MovedFile(size, listed.sha256, content=bytes(whole))
        if is_whole:
            require_media(name, bytes(whole))
        return MovedFile(size, listed.sha256, at=self._place(member))

    def _blocks(self, name: str) -> Iterator[bytes]:
        # `zipfile` compares the CRC, and never gives more bytes than the directory announces.
        with self._archive.open(self._members[name]) as content:
            while block := content.read(_BLOCK):
                yield block

    def _place(self, member: zipfile.ZipInfo) -> int:
        """Return where the content of a file begins that is stored as it is."""
        self._file.seek(member.header_offset)
        signature, name, extra = _LOCAL_HEAD.unpack(self._file.read(_LOCAL_HEAD.size))
        if signature != b"PK\x03\x04":
            raise InvalidImport(f"The ZIP is damaged where {member.filename} begins.")
        return member.header_offset + _LOCAL_HEAD.size + int(name) + int(extra)


def _members(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """Return the files by name; refuse what no archive file has before anything is read."""
    infos = members_of(archive)
    if len(infos) > MOST_FILES:
        raise InvalidImport(f"The ZIP has {len(infos)} files; an archive file has {MOST_FILES}.")
    found: dict[str, zipfile.ZipInfo] = {}
    for info in infos:
        name = info.filename
        if not _EXPECTED.fullmatch(name):
            raise InvalidImport(f"No archive file of Chainage has a file {name!r:.200}.")
        if name in found:
            raise InvalidImport(f"The ZIP has two files {name!r}.")
        mode = info.external_attr >> 16
        if info.flag_bits & _ENCRYPTED or stat.S_IFMT(mode) not in (0, stat.S_IFREG):
            raise InvalidImport(f"{name} is encrypted, or no plain file.")
        _require_form(info)
        found[name] = info
    return found


def _require_form(info: zipfile.ZipInfo) -> None:
    """Require that only texts are compressed, and none is larger than a report may be."""
    if info.filename.endswith(COMPRESSED):
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise InvalidImport(f"{info.filename} is compressed in another way than deflate.")
        if info.file_size > _MOST_TEXT_BYTES:
            raise InvalidImport(
                f"{info.filename} has {info.file_size / MIB:.1f} MiB; it may have "
                f"{_MOST_TEXT_BYTES // MIB}."
            )
    elif info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size:
        raise InvalidImport(f"{info.filename} is compressed; an archive file stores it as it is.")


def _require_apart(taken: list[tuple[int, int]]) -> None:
    end = 0
    for first, last in sorted(taken):
        if first < end:
            raise InvalidImport("Two files of the ZIP share the same bytes.")
        end = last


def _require_film_of(inspection: WholeInspection, files: Mapping[str, MovedFile]) -> None:
    films = [file for name, file in files.items() if name.startswith(FILM)]
    if len(films) > 1:
        raise InvalidImport("The archive file has more than one film.")
    if films and films[0].sha256 != inspection.about.source.sha256:
        raise InvalidImport("The film in the archive file is not that of the inspection.")


def _require_codes(inspection: WholeInspection, files: Mapping[str, MovedFile]) -> None:
    """Read the code pack once, so that the server never finds an invalid one."""
    if (table := files.get(PACK)) is not None and table.content is not None:
        try:
            read_table(inspection.code_pack or "", table.content)
        except InvalidPack as error:
            raise InvalidImport(f"The code pack in the archive file is invalid: {error}") from error
