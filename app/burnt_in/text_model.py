"""Finds lines of text in a picture and reads them, with the networks of PP-OCRv6.

The package rapidocr brings the networks (Apache 2.0, by PaddleOCR) as ONNX files. OpenCV runs them,
so neither the code of that package nor another runtime is loaded. Detection is differentiable
binarisation (Liao et al. 2020); recognition is a network with a CTC output (Graves et al. 2006).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import distribution
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.burnt_in.box import Box
from vo_core.types import ByteImage

ALPHABET = "0123456789.,:/+-%'\"() =ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
"""Characters that a line can have; the network knows 18,000 more."""

LINE_PX = 48
"""Height of a line in the recognition network."""

DETECTION_PX = 736
"""Longer side of a picture in the detection network."""

TEXT = 0.3
"""Probability from which a pixel belongs to a line of text."""

SURELY_TEXT = 0.6
"""Probability that at least one pixel of a line has."""

LEAST_PX = 6
"""Least width and height of a line; nobody reads smaller text."""

WIDEN = 1.6
"""Area over perimeter by which a detected line is widened on all sides."""


@dataclass(frozen=True)
class Letter:
    """A character as read."""

    best: str
    sure: float
    """Probability of `best` among all characters that the network knows."""
    other: str
    """The second best, of the same alphabet; empty if it is none."""
    other_sure: float


class TextReader:
    """Reads one line of text."""

    def __init__(self) -> None:
        import cv2

        file = _model("PP-OCRv6_rec_small.onnx")
        self._network = cv2.dnn.readNetFromONNX(str(file))
        known = ["", *_metadata(file)["character"].split("\n"), " "]
        self._indices = np.array([0, *(known.index(letter) for letter in ALPHABET)])

    def __call__(self, line: ByteImage) -> tuple[Letter, ...]:
        """Read a line, (H, W, 3) BGR."""
        import cv2

        height, width = line.shape[:2]
        size = (max(LINE_PX, round(width * LINE_PX / height)), LINE_PX)
        picture = cv2.resize(line, size, interpolation=cv2.INTER_LINEAR)
        self._network.setInput(cv2.dnn.blobFromImage(picture, 1 / 127.5, mean=(127.5,) * 3))
        return _letters(self._network.forward()[0][:, self._indices])


def _letters(columns: NDArray[np.float32]) -> tuple[Letter, ...]:
    """The most probable character of each column, without blanks and repetitions.

    Args:
        columns: (T, 1 + N) probabilities of the blank and of the alphabet, from left to right.
    """
    letters: list[Letter] = []
    best = columns.argmax(axis=1).tolist()
    for column, (before, index) in zip(columns, pairwise([0, *best]), strict=True):
        if index == 0:
            continue
        letter = _letter(column, index)
        if index != before:
            letters.append(letter)
        elif letter.sure > letters[-1].sure:
            letters[-1] = letter
    return tuple(letters)


def _letter(column: NDArray[np.float32], best: int) -> Letter:
    others = column.copy()
    others[[0, best]] = 0
    other = int(others.argmax())
    return Letter(
        ALPHABET[best - 1], float(column[best]), ALPHABET[other - 1], float(column[other])
    )


class TextDetector:
    """Finds lines of text in a picture."""

    def __init__(self) -> None:
        import cv2

        self._network = cv2.dnn.readNetFromONNX(str(_model("PP-OCRv6_det_small.onnx")))

    def __call__(self, picture: ByteImage) -> list[Box]:
        """Boxes around the level lines of a picture, (H, W, 3) BGR."""
        import cv2

        height, width = picture.shape[:2]
        scale = DETECTION_PX / max(height, width)
        size = (round(width * scale / 32) * 32, round(height * scale / 32) * 32)
        self._network.setInput(
            cv2.dnn.blobFromImage(picture, 1 / 127.5, size=size, mean=(127.5,) * 3)
        )
        return _boxes(self._network.forward()[0, 0], (width, height))


def _boxes(text: NDArray[np.float32], size_wh: tuple[int, int]) -> list[Box]:
    """Boxes around the regions of text.

    The network is trained on regions that are shrunk by a multiple of area over perimeter, so they
    are widened again (Liao et al. 2020, section 3.4).

    Args:
        text: (h, w) probabilities.
        size_wh: Width and height of the picture.
    """
    import cv2

    width, height = size_wh
    x, y = width / text.shape[1], height / text.shape[0]
    count, _, stats, _ = cv2.connectedComponentsWithStats((text > TEXT).astype(np.uint8))
    boxes = []
    for left, top, wide, high, _ in stats[1:count].tolist():
        if text[top : top + high, left : left + wide].max() < SURELY_TEXT:
            continue
        rim = WIDEN * wide * high / (2 * (wide + high))
        box = Box(
            max(0, round((left - rim) * x)),
            max(0, round((top - rim) * y)),
            min(width, round((left + wide + rim) * x)),
            min(height, round((top + high + rim) * y)),
        )
        if min(box.width, box.height) >= LEAST_PX:
            boxes.append(box)
    return boxes


def _model(name: str) -> Path:
    return Path(str(distribution("rapidocr").locate_file(f"rapidocr/models/{name}")))


def _metadata(file: Path) -> dict[str, str]:
    """Read the `metadata_props` of an ONNX file: field 14 of its ModelProto, key and value each."""
    pairs = [dict(_fields(pair)) for number, pair in _fields(file.read_bytes()) if number == 14]
    return {bytes(pair[1]).decode(): bytes(pair[2]).decode() for pair in pairs}


def _fields(message: bytes | memoryview) -> Iterator[tuple[int, memoryview]]:
    """Yield number and content of the length-delimited fields of a protocol buffer message."""
    view, at = memoryview(message), 0
    while at < len(view):
        key, at = _varint(view, at)
        value, at = _varint(view, at)
        if key & 7 == 2:  # otherwise it was a number
            yield key >> 3, view[at : at + value]
            at += value


def _varint(view: memoryview, at: int) -> tuple[int, int]:
    """Read a number of seven bits a byte, lowest first; return it and the place after it."""
    value = shift = 0
    while True:
        byte, at = view[at], at + 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at
