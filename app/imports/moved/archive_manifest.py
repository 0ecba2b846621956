"""The archive file: one inspection as a ZIP, whole, so that it can move between servers.

`inspection.json` is the report in JSON (`app.reports.exchange.chainage_json`), which names the
photos and voice notes of its tags and attachments. `manifest.json` lists every other file with its
size and SHA-256. Copies of photos with marks are not in it: they are made of photo and strokes.
"""

from __future__ import annotations

import msgspec

SCHEMA = "chainage-archive/1"
MANIFEST = "manifest.json"
REPORT = "inspection.json"
COUNTER, READINGS, PARTS = "counter.json", "counter.csv", "parts.csv"
"""What is known of the burnt-in counter, its readings, and where the parts of a recording begin."""
PACK = "code-pack.csv"
"""The table of codes, if a person has added it."""
PHOTOS, VOICE, WALL, FILM = "photos/", "voice/", "wall/", "film/"

COMPRESSED = (".json", ".csv")
"""All other files are stored as they are, so that they can be read without unpacking the ZIP."""


class Listed(msgspec.Struct, frozen=True):
    """A file of the ZIP as the manifest lists it: it must be there, and have this digest."""

    size: int
    sha256: str


class Manifest(msgspec.Struct, frozen=True):
    """The content of an archive file."""

    schema: str
    program: str
    inspection_id: str
    name: str
    made_at: str
    files: dict[str, Listed]
    missing: list[str]
    """Files that the report names and that no longer exist; the film if it was not wanted."""


def not_as_listed(path: str) -> str:
    """Return the sentence about a file that differs from what the manifest says of it."""
    return f"{path} is not the file that the manifest lists: it was damaged or changed."
