"""Models of users: what they find on a patch, and files that must not be loaded."""

from __future__ import annotations

import numpy as np
import onnx_files as onnx
import pytest

from app.errors import InvalidDetector
from app.inspections.findings import finder
from app.jobs.detect.user_model import UserModel
from app.survey.findings.declaration import Declaration, read_declaration
from vo_core.findings import patches
from vo_core.findings.patches import WallPatch

X, Y = [("x", (1, 1, 128, 128))], [("y", (1, 1, 128, 128))]
CONV = onnx.node("Conv", ["x", "w"], ["y"], onnx.ints("kernel_shape", [1, 1]))
WEIGHT = onnx.tensor("w", np.ones((1, 1, 1, 1)))
DARK = """
name: Dark
task: segment
input: [128, 128]
mm_per_px: 1.0
colours: grey
output: logits
classes: [{kind: crack}]
"""
BOXES = """
name: Boxes
task: detect
input: [128, 128]
mm_per_px: 1.0
output: columns
classes: [{kind: crack}, {kind: hole, code: BAC, char1: A}, {}]
"""


def declared(text: str, **changes: str) -> Declaration:
    return read_declaration(text + "\n".join(f"{name}: {value}" for name, value in changes.items()))


def patch(height: int, width: int) -> WallPatch:
    """A grey piece of wall with pixels of 0.5 mm."""
    image = np.full((height, width, 3), 150, np.uint8)
    return WallPatch(image, np.ones((height, width), np.float32), 1000.0, -300.0, 0.5, 0.5, None)


def test_a_dark_line_over_several_tiles_is_one_crack_of_its_size() -> None:
    wall = patch(600, 1000)
    for column in range(200, 800):
        row = 100 + round(0.3 * (column - 200))
        wall.image[row : row + 6, column] = 30
    wall.image[400:406, 100:800] = 30
    wall.weight[390:420] = 0  # as if nobody had seen it
    (found,) = UserModel(onnx.finds_dark(), declared(DARK)).propose(wall)
    length = 300 * np.hypot(1, 0.3)
    assert found.kind == "crack"
    assert found.length is not None
    assert found.length.mm == pytest.approx(length, rel=0.03)
    assert found.width is not None
    assert found.width.mm == pytest.approx(3 / np.hypot(1, 0.3), abs=1.2)
    assert found.direction == "along"
    assert np.ptp(found.outline_mm, axis=0) == pytest.approx([300, 90], abs=5)
    assert found.outline_mm.min(0) == pytest.approx([1100, -250], abs=3)


def boxes(*columns: list[float]) -> bytes:
    """A network that says these boxes of any picture."""
    rows = np.array(columns, np.float32).T[None]
    nodes = [
        onnx.node("ReduceSum", ["x"], ["q"]),
        onnx.node("Reshape", ["q", "one"], ["s"]),
        onnx.node("Mul", ["s", "zero"], ["t"]),
        onnx.node("Add", ["t", "rows"], ["y"]),
    ]
    tensors = [
        onnx.tensor("one", [1, 1, 1], onnx.INT64),
        onnx.tensor("zero", [0.0]),
        onnx.tensor("rows", rows),
    ]
    return onnx.model(onnx.graph(nodes, tensors, [("x", (1, 3, 128, 128))], [("y", rows.shape)]))


def test_boxes_become_findings_once_and_background_does_not() -> None:
    network = boxes(
        [64, 64, 40, 10, 0.9, 0.1, 0.0],
        [66, 64, 40, 10, 0.8, 0.1, 0.0],
        [20, 100, 10, 30, 0.1, 0.7, 0.0],
        [90, 30, 10, 10, 0.1, 0.1, 0.9],
        [90, 90, 10, 10, 0.4, 0.1, 0.0],
    )
    found = UserModel(network, declared(BOXES)).propose(patch(256, 256))
    assert [each.kind for each in found] == ["crack", "hole"]
    crack, hole = found
    assert crack.outline_mm.tolist() == [[1044, -236], [1064, -236], [1084, -236]]
    assert (crack.length and crack.length.mm, crack.width) == (40, None)
    assert [size and size.mm for size in (hole.length, hole.width)] == [10, 30]


def test_the_server_counts_blocks_as_the_search_does() -> None:
    assert finder.BLOCK_TILES == patches.BLOCK_TILES


HOSTILE = {
    "cut off": (onnx.finds_dark()[:600], "cut off"),
    "no model": (b"\x08\x08", "no graph"),
    "values elsewhere": (
        onnx.model(onnx.graph([CONV], [onnx.outside("w", (1, 1, 1, 1), "../token")], X, Y)),
        "another file",
    ),
    "gigantic tensor": (
        onnx.model(onnx.graph([CONV], [onnx.huge("w", (2**31, 2**31, 1, 1))], X, Y)),
        "announces more",
    ),
    "endless loop": (
        onnx.model(
            onnx.graph(
                [onnx.node("Loop", ["", ""], ["y"], onnx.graph_of("body", onnx.graph([CONV])))],
                [WEIGHT],
                X,
                Y,
            )
        ),
        r"control flow \(Loop\)",
    ),
    "circle": (
        onnx.model(
            onnx.graph(
                [onnx.node("Add", ["x", "z"], ["y"]), onnx.node("Add", ["y", "x"], ["z"])], [], X, Y
            )
        ),
        "cannot be loaded",
    ),
    "unknown layer": (
        onnx.model(onnx.graph([onnx.node("Quux", ["x"], ["y"])], [], X, Y)),
        "cannot be loaded: OpenCV says .*Quux",
    ),
    "another output": (
        onnx.model(
            onnx.graph(
                [onnx.node("Conv", ["x", "w"], ["y"], onnx.ints("kernel_shape", [1, 1]))],
                [onnx.tensor("w", np.ones((3, 1, 1, 1)))],
                X,
                Y,
            )
        ),
        r"shape \[1, 3, 128, 128\], which is not \[1, 1, H, W\]",
    ),
    "bomb": (
        onnx.model(
            onnx.graph(
                [onnx.node("Tile", ["x", "n"], ["y"])],
                [onnx.tensor("n", [1, 1, 9000, 9000], onnx.INT64)],
                X,
                Y,
            )
        ),
        "needs more memory",
    ),
}


@pytest.mark.parametrize(("content", "why"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_file_is_refused_in_a_sentence(content: bytes, why: str) -> None:
    with pytest.raises(InvalidDetector, match=why):
        UserModel(content, declared(DARK)).try_out()
