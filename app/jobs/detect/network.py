"""Runs a user's network over a picture, tile by tile."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidDetector
from app.jobs.detect.onnx_file import require_plain
from app.survey.findings.declaration import Declaration
from vo_core.types import ByteImage, GrayImage

_GREY = 128
_SEEN = 0.3
"""Share of a tile that must have been seen for the network to look at it."""
_MOST_REPORTED = 200
_NO_MEMORY = -4
"""`cv2.Error.StsNoMem`."""
_PLACE = re.compile(r"OpenCV\([^)]*\) \S+ error: \([^)]*\) ")


@dataclass(frozen=True)
class Answer:
    """What the network says of one tile of a picture."""

    column: int
    """Left border of the tile in the picture, px."""
    row: int
    output: GrayImage
    """By the declaration: (N, C) boxes, (C, H, W) scores, or (H, W) labels."""


class Network:
    """A loaded network.

    Raises:
        InvalidDetector: The file cannot be used.
    """

    def __init__(self, content: bytes, declared: Declaration) -> None:
        require_plain(content)
        self._declared = declared
        try:
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
            self._outputs = self._net.getUnconnectedOutLayersNames()
        except cv2.error as error:
            raise InvalidDetector(f"The model cannot be loaded: {_reason(error)}") from error

    def try_out(self) -> None:
        """Run it once on a grey picture.

        Raises:
            InvalidDetector: It fails, or its output is not as declared.
        """
        width, height = self._declared.input
        self._run(np.full((height, width, 3), _GREY, np.uint8))

    def look(self, picture: ByteImage, weight: GrayImage) -> Iterator[Answer]:
        """Yield the answers for overlapping tiles of a picture, but for those that nobody saw.

        Args:
            picture: (H, W, 3) BGR at the declared size of a pixel.
            weight: (H, W) how well each place was seen.
        """
        width, height = self._declared.input
        for row in self._starts(picture.shape[0], height):
            for column in self._starts(picture.shape[1], width):
                there = slice(row, row + height), slice(column, column + width)
                seen = weight[there]
                if seen.size and float((seen > 0).mean()) >= _SEEN:
                    tile = np.full((height, width, 3), _GREY, np.uint8)
                    part = picture[there]
                    tile[: part.shape[0], : part.shape[1]] = part
                    yield Answer(column, row, self._run(tile))

    def _starts(self, whole: int, side: int) -> list[int]:
        if whole <= side:
            return [0]
        step = max(round(side * (1 - self._declared.overlap)), 1)
        return [*range(0, whole - side, step), whole - side]

    def _run(self, tile: ByteImage) -> GrayImage:
        declared = self._declared
        try:
            self._net.setInput(self._blob(tile))
            found = self._net.forward(self._outputs)
        except cv2.error as error:
            raise InvalidDetector(
                f"The model does not run on a picture of {declared.input[0]} x "
                f"{declared.input[1]} px, {declared.colours}: {_reason(error)}"
            ) from error
        for each in found:
            output = self._fitting(np.asarray(each))
            if output is not None:
                return np.nan_to_num(output.astype(np.float32), posinf=0.0, neginf=0.0)
        shapes = ", ".join(str(list(np.shape(each))) for each in found)
        raise InvalidDetector(
            f"The output of the model has the shape {shapes:.{_MOST_REPORTED}}, which is not "
            f"{self._expected()}, as declared."
        )

    def _blob(self, tile: ByteImage) -> NDArray[np.float32]:
        declared = self._declared
        if declared.colours == "grey":
            tile = np.asarray(cv2.cvtColor(tile, cv2.COLOR_BGR2GRAY), np.uint8)[..., None]
        elif declared.colours == "rgb":
            tile = tile[..., ::-1]
        mean, scale = np.array(declared.mean), np.array(declared.scale)
        return np.ascontiguousarray(((tile - mean) * scale).transpose(2, 0, 1)[None], np.float32)

    def _fitting(self, output: NDArray[np.generic]) -> NDArray[np.generic] | None:
        """Return an output in the form of `Answer`, None if it is not what is declared."""
        declared, classes = self._declared, len(self._declared.classes)
        if output.ndim < 2 or output.shape[0] != 1:
            return None
        output = output[0]
        if declared.task == "detect":
            if output.ndim != 2:
                return None
            rows = output.T if declared.output == "columns" else output
            return rows if rows.shape[1] == 4 + declared.objectness + classes else None
        if declared.output == "labels" and output.ndim == 2:
            return output
        if output.ndim != 3:
            return None
        if declared.output == "labels":
            return output[0] if len(output) == 1 else None
        return output if len(output) == classes else None

    def _expected(self) -> str:
        declared, classes = self._declared, len(self._declared.classes)
        values = 4 + declared.objectness + classes
        return {
            "rows": f"[1, N, {values}]",
            "columns": f"[1, {values}, N]",
            "labels": "[1, H, W]",
        }.get(declared.output, f"[1, {classes}, H, W]")


def _reason(error: cv2.error) -> str:
    if error.code == _NO_MEMORY:
        return "it needs more memory than it may use."
    # Only OpenCV's own words: its messages also name places in its source.
    words = _PLACE.sub("", (error.err or "").replace("> ", "")).strip()
    return f"OpenCV says {words[:_MOST_REPORTED]!r}."
