"""Photos and logos as JPEG, no larger than paper can show."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image
from reportlab.lib.utils import ImageReader

_QUALITY = 82


class Jpeg(ImageReader):
    """A JPEG file that is embedded as it is."""

    _dataA = None  # noqa: N815
    """The mask, which a JPEG has not."""

    def __init__(self, content: bytes) -> None:
        super().__init__(io.BytesIO(content))
        self._content = content

    def getRGBData(self) -> bytes:  # noqa: N802
        """What tells pictures apart: ReportLab would decode each of them for that."""
        return self._content


def jpeg_of(path: Path | None, longest_px: int) -> Jpeg | None:
    """The picture, reduced if it has more pixels than that; None if it cannot be read."""
    if path is None:
        return None
    try:
        content = path.read_bytes()
        with Image.open(io.BytesIO(content)) as picture:
            is_fit = picture.format == "JPEG" and picture.mode in ("RGB", "L")
            if max(picture.size) > longest_px:
                # The decoder of JPEG halves cheaply, more than the eye needs is left.
                picture.draft("RGB", (longest_px, longest_px))
                picture.thumbnail((longest_px, longest_px), reducing_gap=2.0)
                is_fit = False
            else:
                picture.load()
            return Jpeg(content if is_fit else _encoded(picture))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None


def _encoded(picture: Image.Image) -> bytes:
    """As JPEG; what is transparent becomes white as the paper."""
    if picture.mode not in ("RGB", "L"):
        rgba = picture.convert("RGBA")
        paper = Image.new("RGBA", rgba.size, "white")
        picture = Image.alpha_composite(paper, rgba).convert("RGB")
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=_QUALITY)
    return out.getvalue()
