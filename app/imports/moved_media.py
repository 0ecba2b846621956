"""Checks photos and sounds that come along with an inspection; only for a child process."""

from __future__ import annotations

from app.errors import InvalidImport
from app.imports.archive_manifest import VOICE
from app.survey.attachments import MOST_VOICE_BYTES

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
    import cv2  # slow to import, and few files have pictures
    import numpy as np

    if not content.startswith(_JPEG) or len(content) > _MOST_PHOTO_BYTES:
        raise InvalidImport(f"{path} is no picture in JPEG.")
    try:
        picture = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_GRAYSCALE)
    except cv2.error:
        picture = None
    if picture is None or max(picture.shape) > _MOST_SIDE_PX:
        raise InvalidImport(f"{path} cannot be decoded as a picture in JPEG.")
