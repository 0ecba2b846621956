"""Checks photos and sounds that come along with an inspection; only for a child process."""

from __future__ import annotations

from app.errors import InvalidImport
from app.imports.moved.archive_manifest import VOICE
from app.pictures import UnusablePicture, require_picture
from app.survey.observations.attachments import MOST_VOICE_BYTES

_MOST_PHOTO_BYTES = 32 * 2**20
_MOST_SIDE_PX = 8192
_JPEG = b"\xff\xd8\xff"


def require_media(path: str, content: bytes) -> None:
    """Decode a picture, and limit a sound.

    Raises:
        InvalidImport: The file is no picture, or too large.
    """
    if path.startswith(VOICE):
        if not 0 < len(content) <= MOST_VOICE_BYTES:
            raise InvalidImport(f"{path} has {len(content)} bytes, which is no voice note.")
        return
    if not content.startswith(_JPEG) or len(content) > _MOST_PHOTO_BYTES:
        raise InvalidImport(f"{path} is no picture in JPEG.")
    try:
        require_picture(content, _MOST_SIDE_PX)
    except UnusablePicture as error:
        raise InvalidImport(f"{path} {error}") from error
