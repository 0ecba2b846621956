"""Pictures that people bring, and logos as reports show them."""

import io
from dataclasses import dataclass

import pytest
from PIL import Image

from app.pictures import UnusablePicture, require_picture
from app.reports.content.pictures import logo_of


@dataclass(frozen=True)
class InMemory:
    content: bytes

    def read_bytes(self) -> bytes:
        return self.content


def drawn(mode: str, kind: str, size: tuple[int, int] = (120, 80)) -> bytes:
    out = io.BytesIO()
    Image.new(mode, size, 1 if mode in ("P", "1") else None).save(out, kind)
    return out.getvalue()


FORMS = [("RGB", "PNG"), ("RGBA", "PNG"), ("P", "PNG"), ("1", "PNG"), ("LA", "PNG"),
         ("I;16", "PNG"), ("RGB", "JPEG"), ("L", "JPEG"), ("CMYK", "JPEG")]  # fmt: skip


@pytest.mark.parametrize(("mode", "kind"), FORMS)
def test_whatever_logo_is_taken_is_printed_too(mode: str, kind: str) -> None:
    content = drawn(mode, kind)
    require_picture(content, 120)
    logo = logo_of(InMemory(content), 40)
    assert logo is not None
    assert 40 <= logo.size[0] < 80


@pytest.mark.parametrize("content", [b"", b"GIF89a", drawn("L", "PNG")[:-30], b"\xff\xd8\xff\xc0"])
def test_what_is_no_whole_picture_is_refused(content: bytes) -> None:
    with pytest.raises(UnusablePicture, match="no PNG or JPEG"):
        require_picture(content, 120)


@pytest.mark.parametrize(("mode", "kind"), FORMS)
def test_a_picture_that_is_too_large_is_refused_by_its_header(mode: str, kind: str) -> None:
    only_header = drawn(mode, kind, (121, 1))[:-4]
    with pytest.raises(UnusablePicture, match="121 x 1 pixels; at most 120"):
        require_picture(only_header, 120)


def test_a_logo_is_decoded_once() -> None:
    content = drawn("RGB", "PNG")
    assert logo_of(InMemory(content), 40) is logo_of(InMemory(bytes(bytearray(content))), 40)
