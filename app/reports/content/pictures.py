"""Photos and logos as JPEG, not much larger than paper can show."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import lru_cache

from PIL import Image

from app.reports.report import Photo, why_lost
from app.storage.blobs.blobs import Readable

_QUALITY = 76


@dataclass(frozen=True)
class Jpeg:
    """A JPEG file that is embedded unchanged."""

    content: bytes
    size: tuple[int, int]
    """Width and height, px."""


def jpeg_of(stored: Readable | None, enough_px: int) -> Jpeg | None:
    """Return the picture as JPEG; None if it cannot be read.

    Args:
        stored: JPEG or PNG; it may be missing or broken.
        enough_px: Sufficient longer side; a larger picture is halved while it stays above this.
    """
    content = _content(stored)
    return None if content is None else _fitted(content, enough_px)


def logo_of(stored: Readable | None, enough_px: int) -> Jpeg | None:
    """Return a logo as `jpeg_of` does; each is decoded once, and not for every report."""
    content = _content(stored)
    return None if content is None else _fitted_logo(content, enough_px)


def _content(stored: Readable | None) -> bytes | None:
    try:
        return None if stored is None else stored.read_bytes()
    except OSError:
        return None


def _fitted(content: bytes, enough_px: int) -> Jpeg | None:
    try:
        with Image.open(io.BytesIO(content)) as picture:
            is_fit = picture.format == "JPEG" and picture.mode in ("RGB", "L")
            size = picture.size
            times = max(size) // enough_px
            if times < 2 and is_fit:
                # Decoding at an eighth of the size also shows whether the whole file can be
                # decoded.
                picture.draft(picture.mode, (1, 1))
                picture.load()
                return Jpeg(content, size)
            return _encoded(_halved(picture, times))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None


_fitted_logo = lru_cache(maxsize=16)(_fitted)


def why_not_shown(photo: Photo) -> str:
    """Return the key of the sentence why the picture of a photo cannot be shown."""
    try:
        if photo.original is None:
            return "photos.missing"
        photo.original.read_bytes()
    except FileNotFoundError as error:
        return "photos.missing" if why_lost(error) == "gone" else "photos.changed"
    return "photos.broken"


def _halved(picture: Image.Image, times: int) -> Image.Image:
    """Reduce the picture, at most to 1 / `times`."""
    width, height = picture.size
    if times >= 2:
        picture.draft("RGB", (width // times, height // times))  # during decoding: cheap
    if picture.mode not in ("RGB", "L"):  # such as a palette, whose numbers have no mean
        picture = picture.convert("RGBA")
    left = picture.size[0] * times // width
    return picture.reduce(left) if left > 1 else picture


def _encoded(picture: Image.Image) -> Jpeg:
    """Encode as JPEG; transparent parts become white like the paper."""
    if picture.mode == "RGBA":
        paper = Image.new("RGBA", picture.size, "white")
        picture = Image.alpha_composite(paper, picture).convert("RGB")
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=_QUALITY)
    return Jpeg(out.getvalue(), picture.size)
