"""Pictures that people bring: what the header claims is looked at before anything is decoded."""

from __future__ import annotations

import io

from PIL.ImageFile import ImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile

MOST_LOGO_PX = 4000
"""Longest side of a logo."""
_FORMS = {b"\x89PNG\r\n\x1a\n": PngImageFile, b"\xff\xd8\xff": JpegImageFile}


class UnusablePicture(ValueError):
    """The text completes a sentence that begins with what the picture is."""


def require_picture(content: bytes, most_px: int) -> None:
    """Require a whole PNG or JPEG whose sides have at most `most_px`.

    Raises:
        UnusablePicture: It is none; a picture that claims to be larger is not decoded.
    """
    try:
        with _opened(content) as picture:
            width, height = picture.size
            if is_fit := max(width, height) <= most_px:
                picture.draft("L", (1, 1))  # of a JPEG: an eighth of the size, of the whole file
                picture.load()
    except (OSError, ValueError, SyntaxError) as error:
        raise UnusablePicture("is no PNG or JPEG, or it is damaged.") from error
    if not is_fit:
        raise UnusablePicture(
            f"is {width} x {height} pixels; at most {most_px} each way are allowed. Save it "
            "smaller."
        )


def _opened(content: bytes) -> ImageFile:
    """Read the header.

    Unlike Pillow's `open`, this has no limits of its own, one of which is a warning on the error
    output, and the other no error of a damaged file.
    """
    form = next((form for start, form in _FORMS.items() if content.startswith(start)), None)
    if form is None:
        raise ValueError("it begins as neither does")
    return form(io.BytesIO(content))
