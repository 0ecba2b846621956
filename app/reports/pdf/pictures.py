"""Photos and logos as JPEG, not much larger than paper can show."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image
from reportlab.lib.utils import ImageReader

_QUALITY = 76


class Jpeg(ImageReader):
    """A JPEG file that is embedded as it is."""

    _dataA = None  # noqa: N815
    """The mask, which a JPEG has not."""

    def __init__(self, content: bytes) -> None:
        super().__init__(io.BytesIO(content))
        self.content = content
        """Of the file."""

    def getRGBData(self) -> bytes:  # noqa: N802
        """What distinguishes pictures: ReportLab would decode each of them for that."""
        return self.content


def jpeg_of(path: Path | None, enough_px: int) -> Jpeg | None:
    """The picture as JPEG; None if it cannot be read.

    Args:
        path: JPEG or PNG; the file may be gone or broken.
        enough_px: Of the longer side. A larger picture is halved as long as it keeps that much.
    """
    if path is None:
        return None
    try:
        content = path.read_bytes()
        with Image.open(io.BytesIO(content)) as picture:
            is_fit = picture.format == "JPEG" and picture.mode in ("RGB", "L")
            times = max(picture.size) // enough_px
            if times < 2 and is_fit:
                # An eighth of its size shows as well whether all of it can be decoded.
                picture.draft(picture.mode, (1, 1))
                picture.load()
                return Jpeg(content)
            return Jpeg(_encoded(_halved(picture, times)))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None


def _halved(picture: Image.Image, times: int) -> Image.Image:
    """So many times smaller at the most."""
    if times < 2:
        return picture
    width, height = picture.size
    picture.draft("RGB", (width // times, height // times))  # while it is decoded: cheap
    left = picture.size[0] * times // width
    return picture.reduce(left) if left > 1 else picture


def _encoded(picture: Image.Image) -> bytes:
    """As JPEG; what is transparent becomes white as the paper."""
    if picture.mode not in ("RGB", "L"):
        rgba = picture.convert("RGBA")
        paper = Image.new("RGBA", rgba.size, "white")
        picture = Image.alpha_composite(paper, rgba).convert("RGB")
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=_QUALITY)
    return out.getvalue()
