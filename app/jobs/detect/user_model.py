"""A user's model as a detector: boxes and masks become findings on the wall."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from app.jobs.detect.network import Answer, Network
from app.survey.findings.declaration import Declaration
from vo_core.findings.finding import Direction, Finding, Size
from vo_core.findings.patches import WallPatch
from vo_core.types import ByteImage, GrayImage, Matrix

_SAME_BOX = 0.5
"""Overlap of two boxes that are one."""
_MOST_OF_A_PATCH = 300
_LINE_STEP_PX = 6.0
_EDGE_PX = 1.0
"""Standard uncertainty of the border of a region, px."""
_ALONG, _ACROSS = 30.0, 60.0
"""Degrees from the axis of the pipe."""

Labels = NDArray[np.uint8]
ToMm = Callable[[Matrix], Matrix]


@dataclass(frozen=True)
class _Picture:
    """A patch at the pixel size of the model."""

    image: ByteImage
    weight: GrayImage
    to_mm: ToMm
    """From (n, 2) pixels as column and row to axial and arc."""


class UserModel:
    """A `Detector` of a user.

    Raises:
        InvalidDetector: The file cannot be used.
    """

    def __init__(self, content: bytes, declared: Declaration) -> None:
        self._declared = declared
        self._network = Network(content, declared)
        self._mm_per_px = declared.mm_per_px

    def try_out(self) -> None:
        """Run it once; raise InvalidDetector if that fails."""
        self._network.try_out()

    def propose(self, patch: WallPatch) -> list[Finding]:
        """Find what is on a patch."""
        if not (patch.weight > 0).any():
            return []
        picture = self._resized(patch)
        answers = self._network.look(picture.image, picture.weight)
        if self._declared.task == "detect":
            return self._of_boxes(picture, answers)
        return self._of_masks(picture, answers)

    def _resized(self, patch: WallPatch) -> _Picture:
        height, width = patch.weight.shape
        size_wh = (
            max(round(width * patch.mm_per_px / self._mm_per_px), 1),
            max(round(height * patch.arc_mm_per_px / self._mm_per_px), 1),
        )
        is_finer = size_wh[0] < width
        how = cv2.INTER_AREA if is_finer else cv2.INTER_LINEAR
        share = np.array([width / size_wh[0], height / size_wh[1]])
        return _Picture(
            np.asarray(cv2.resize(patch.image, size_wh, interpolation=how), np.uint8),
            np.asarray(cv2.resize(patch.weight, size_wh, interpolation=cv2.INTER_AREA), np.float32),
            lambda pixels: patch.to_mm((pixels + 0.5) * share - 0.5),
        )

    def _of_boxes(self, picture: _Picture, answers: Iterator[Answer]) -> list[Finding]:
        declared = self._declared
        boxes, scores, numbers = [], [], []
        for answer in answers:
            rows = answer.output
            first = 4 + declared.objectness
            of_class = rows[:, first:] * (rows[:, 4:5] if declared.objectness else 1)
            best, score = of_class.argmax(1), of_class.max(1)
            keep = (score >= declared.threshold) & (rows[:, 2:4] > 0).all(1)
            centre, size = rows[keep, :2], rows[keep, 2:4]
            if declared.boxes == "share":
                centre, size = (each * np.array(declared.input) for each in (centre, size))
            begin = centre - size / 2 + np.array([answer.column, answer.row])
            boxes.append(np.hstack([begin, size]))
            scores.append(np.minimum(score[keep], 1))
            numbers.append(best[keep])
        if not boxes:
            return []
        all_boxes, all_scores = np.vstack(boxes), np.hstack(scores)
        kept = cv2.dnn.NMSBoxesBatched(
            all_boxes.tolist(), all_scores.tolist(), np.hstack(numbers).tolist(),
            declared.threshold, _SAME_BOX,
        )  # fmt: skip
        every = np.hstack(numbers)
        return [
            self._of_box(picture, all_boxes[n], float(all_scores[n]), kind)
            for n in list(kept)[:_MOST_OF_A_PATCH]
            if (kind := declared.classes[every[n]].kind) is not None
        ]

    def _of_box(self, picture: _Picture, box: GrayImage, score: float, kind: str) -> Finding:
        u, v, width, height = box.astype(np.float64)
        if kind == "crack":  # its line is not known, so it is that of the box
            middle = np.array([u + width / 2, v + height / 2])
            reach = np.array([width / 2, 0]) if width >= height else np.array([0, height / 2])
            corners = np.array([middle - reach, middle, middle + reach])
        else:
            corners = np.array([[u, v], [u + width, v], [u + width, v + height], [u, v + height]])
        outline = picture.to_mm(corners - 0.5)
        size_mm = np.ptp(outline, axis=0)
        sigma_mm = 0.1 * size_mm + self._mm_per_px
        if kind == "crack":
            along = int(size_mm.argmax())
            length, width_size = Size(float(size_mm[along]), float(sigma_mm[along])), None
        else:
            length, width_size = (
                Size(float(mm), float(sigma)) for mm, sigma in zip(size_mm, sigma_mm, strict=True)
            )
        return Finding(kind, outline, length, width_size, _direction(kind, outline), score)

    def _of_masks(self, picture: _Picture, answers: Iterator[Answer]) -> list[Finding]:
        declared = self._declared
        shape = picture.weight.shape
        labels, scores = np.zeros(shape, np.uint8), np.zeros(shape, np.float32)
        for answer in answers:
            label, score = self._labelled(answer.output)
            there = (
                slice(answer.row, min(answer.row + label.shape[0], shape[0])),
                slice(answer.column, min(answer.column + label.shape[1], shape[1])),
            )
            own = score[: there[0].stop - answer.row, : there[1].stop - answer.column]
            is_surer = own > scores[there]
            scores[there][is_surer] = own[is_surer]
            mine = label[: own.shape[0], : own.shape[1]]
            labels[there][is_surer] = mine[is_surer]
        scores[picture.weight <= 0] = 0
        found = []
        for number, each in enumerate(declared.classes):
            if each.kind is not None:
                mask = ((labels == number) & (scores >= declared.threshold)).astype(np.uint8)
                found += self._regions(picture, mask, scores, each.kind)
        return sorted(found, key=lambda one: -one.score)[:_MOST_OF_A_PATCH]

    def _labelled(self, output: GrayImage) -> tuple[Labels, GrayImage]:
        """Return the likeliest class of each pixel of the input, and its score."""
        declared = self._declared
        size_wh = (declared.input[0], declared.input[1])
        if declared.output == "labels":
            label = np.clip(output, 0, 255).astype(np.uint8)
            label = np.asarray(cv2.resize(label, size_wh, interpolation=cv2.INTER_NEAREST))
            return label.astype(np.uint8), np.ones(label.shape, np.float32)
        scores = output
        if declared.output == "logits":
            scores = _sigmoid(output) if len(output) == 1 else _softmax(output)
        planes = [cv2.resize(np.ascontiguousarray(plane), size_wh) for plane in scores]
        label = np.asarray(planes).argmax(0).astype(np.uint8)
        return label, np.clip(np.asarray(planes).max(0), 0, 1).astype(np.float32)

    def _regions(
        self, picture: _Picture, mask: Labels, scores: GrayImage, kind: str
    ) -> list[Finding]:
        count, where, stats, _ = cv2.connectedComponentsWithStats(mask)
        least_px = self._declared.least_mm / self._mm_per_px
        large = [n for n in range(1, count) if max(stats[n, 2], stats[n, 3]) >= least_px]
        large.sort(key=lambda n: -int(stats[n, cv2.CC_STAT_AREA]))
        found = []
        for n in large[:_MOST_OF_A_PATCH]:
            u, v, width, height = (int(each) for each in stats[n, :4])
            there = slice(v, v + height), slice(u, u + width)
            region = where[there] == n
            score = float(scores[there][region].mean())
            found.append(self._of_region(picture, region, (u, v), kind, score))
        return found

    def _of_region(
        self,
        picture: _Picture,
        region: NDArray[np.bool_],
        at: tuple[int, int],
        kind: str,
        score: float,
    ) -> Finding:
        if kind == "crack":
            line = _centre_line(region)
            outline = picture.to_mm(line + at)
            long_mm = float(np.linalg.norm(np.diff(outline, axis=0), axis=1).sum())
            sigma_mm = _EDGE_PX * self._mm_per_px
            across_mm = self._mm_per_px**2 * int(region.sum()) / max(long_mm, self._mm_per_px)
            length = Size(long_mm, 2 * sigma_mm + 0.02 * long_mm)
            return Finding(
                kind, outline, length, Size(across_mm, sigma_mm), _direction(kind, outline), score
            )
        contours, _ = cv2.findContours(
            region.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
        )
        contour = max(contours, key=cv2.contourArea)
        pixels = cv2.approxPolyDP(contour, _EDGE_PX, closed=True).reshape(-1, 2)
        outline = picture.to_mm(pixels.astype(np.float64) + at)
        sizes = [
            Size(float(mm) + self._mm_per_px, 2 * _EDGE_PX * self._mm_per_px)
            for mm in np.ptp(outline, axis=0)
        ]
        return Finding(kind, outline, sizes[0], sizes[1], None, score)


def _centre_line(region: NDArray[np.bool_]) -> Matrix:
    """Return the (n, 2) line through the middle of a long region, column and row, from its first
    end along its longer direction.
    """
    rows, columns = np.nonzero(region)
    pixels = np.column_stack([columns, rows]).astype(np.float64)
    offset = pixels - pixels.mean(0)
    axis = np.linalg.svd(offset.T @ offset)[0][:, 0]
    way = offset @ axis
    bins = ((way - way.min()) / _LINE_STEP_PX).astype(np.int64)
    count = np.bincount(bins)
    middle = np.column_stack([np.bincount(bins, pixels[:, k]) for k in (0, 1)])
    inner = middle[count > 0] / count[count > 0, None]
    first, last = pixels[way.argmin()], pixels[way.argmax()]
    return np.vstack([first, inner[1:-1], last])


def _direction(kind: str, outline: Matrix) -> Direction | None:
    if kind != "crack":
        return None
    axial, arc = np.abs(outline[-1] - outline[0])
    turn_deg = float(np.degrees(np.arctan2(arc, axial)))
    return "along" if turn_deg <= _ALONG else "across" if turn_deg >= _ACROSS else "oblique"


def _sigmoid(logits: GrayImage) -> GrayImage:
    return np.asarray(1 / (1 + np.exp(-np.clip(logits, -60, 60))), np.float32)


def _softmax(logits: GrayImage) -> GrayImage:
    parts = np.exp(logits - logits.max(axis=0, keepdims=True))
    return np.asarray(parts / parts.sum(axis=0, keepdims=True), np.float32)
