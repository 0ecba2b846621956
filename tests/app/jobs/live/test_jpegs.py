"""Pictures in the bytes of an MJPEG stream."""

from __future__ import annotations

import cv2
import pytest
from cameras import floor

from app.jobs.live.jpegs import JpegReader


def jpeg_of(number: int, **options: int) -> bytes:
    flags = [value for pair in options.items() for value in (getattr(cv2, pair[0]), pair[1])]
    return cv2.imencode(".jpg", floor(number), flags)[1].tobytes()


def with_thumbnail(jpeg: bytes) -> bytes:
    """A whole picture within a segment of a picture, as EXIF has it."""
    small = cv2.imencode(".jpg", floor(1)[:32, :32])[1].tobytes()
    return jpeg[:2] + b"\xff\xe1" + (len(small) + 8).to_bytes(2) + b"Exif\0\0" + small + jpeg[2:]


PLAIN = jpeg_of(0)
PICTURES = [
    PLAIN,
    jpeg_of(1, IMWRITE_JPEG_PROGRESSIVE=1),
    jpeg_of(2, IMWRITE_JPEG_RST_INTERVAL=4),
    with_thumbnail(jpeg_of(3)),
]


@pytest.mark.parametrize("size", [1, 1400, 10**6])
def test_pictures_of_every_kind_are_found_however_the_stream_is_cut(size: int) -> None:
    stream = b"HTTP text \xff\r\n" + b"\r\n--frame\r\n\r\n".join([*PICTURES, b""])
    reader = JpegReader()
    pieces = (stream[at : at + size] for at in range(0, len(stream), size))
    found = [picture for piece in pieces for picture in reader.feed(piece)]
    assert found == PICTURES
    assert reader.held_bytes < 3


def test_a_picture_without_an_end_or_with_a_wrong_length_costs_no_other_picture() -> None:
    broken = PLAIN[:20] + b"\xff\xe0\xff\xff" + PLAIN[20:]
    found = list(JpegReader().feed(PLAIN[:-2] + PLAIN + broken + 30 * PLAIN))
    assert found[0] == PLAIN[:-2]
    assert found[1] == PLAIN
    assert found[-1] == PLAIN
    assert found.count(PLAIN) > 15
