"""The directory of a ZIP that nobody has checked."""

from __future__ import annotations

import zipfile


def members_of(archive: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
    """Return the members as the directory lists them.

    Raises:
        BadZipFile: One begins before the file. `zipfile` would look there, and the system's refusal
        would pass for a fault of the disk.
    """
    infos = archive.infolist()
    if before := next((info for info in infos if info.header_offset < 0), None):
        raise zipfile.BadZipFile(f"its directory places {before.filename!r:.200} before the file")
    return infos
