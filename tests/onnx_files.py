"""Small ONNX files, written by the bytes of their protobuf messages: good ones and hostile ones.

Numbers of fields: https://github.com/onnx/onnx/blob/main/onnx/onnx.proto.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

FLOAT, INT64 = 1, 7


def _varint(value: int) -> bytes:
    value &= 2**64 - 1
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def _field(number: int, value: int | bytes | str) -> bytes:
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    content = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def tensor(name: str, values: ArrayLike, kind: int = FLOAT) -> bytes:
    array = np.asarray(values, np.float32 if kind == FLOAT else np.int64)
    dims = b"".join(_field(1, size) for size in array.shape)
    return dims + _field(2, kind) + _field(8, name) + _field(9, array.tobytes())


def outside(name: str, dims: Sequence[int], location: str) -> bytes:
    """A tensor whose values lie in another file."""
    entry = _field(1, "location") + _field(2, location)
    shape = b"".join(_field(1, size) for size in dims)
    return shape + _field(2, FLOAT) + _field(8, name) + _field(13, entry) + _field(14, 1)


def huge(name: str, dims: Sequence[int]) -> bytes:
    """A tensor that announces much and holds nothing."""
    return b"".join(_field(1, size) for size in dims) + _field(2, FLOAT) + _field(8, name)


def ints(name: str, values: Sequence[int]) -> bytes:
    return _field(1, name) + b"".join(_field(8, value) for value in values) + _field(20, 7)


def graph_of(name: str, graph: bytes) -> bytes:
    return _field(1, name) + _field(6, graph) + _field(20, 5)


def node(op: str, inputs: Sequence[str], outputs: Sequence[str], *attributes: bytes) -> bytes:
    return b"".join(
        [
            *(_field(1, name) for name in inputs),
            *(_field(2, name) for name in outputs),
            _field(4, op),
            *(_field(5, attribute) for attribute in attributes),
        ]
    )


def _value(name: str, shape: Sequence[int], kind: int = FLOAT) -> bytes:
    dims = b"".join(_field(1, _field(1, size)) for size in shape)
    return _field(1, name) + _field(2, _field(1, _field(1, kind) + _field(2, dims)))


def graph(
    nodes: Sequence[bytes],
    tensors: Sequence[bytes] = (),
    inputs: Sequence[tuple[str, Sequence[int]]] = (),
    outputs: Sequence[tuple[str, Sequence[int]]] = (),
) -> bytes:
    return b"".join(
        [
            *(_field(1, each) for each in nodes),
            _field(2, "g"),
            *(_field(5, each) for each in tensors),
            *(_field(11, _value(*each)) for each in inputs),
            *(_field(12, _value(*each)) for each in outputs),
        ]
    )


def model(whole: bytes) -> bytes:
    return _field(1, 8) + _field(7, whole) + _field(8, _field(1, "") + _field(2, 13))


def finds_dark(width: int = 128, height: int = 128) -> bytes:
    """A network of one convolution: the logit of a pixel that is darker than its surroundings.

    Its input is grey, in 0..1; the kernel is the mean of 15 x 15 px less that of 3 x 3.
    """
    kernel = np.full((15, 15), 1 / 225)
    kernel[6:9, 6:9] -= 1 / 9
    return model(
        graph(
            [
                node("Conv", ["x", "w", "b"], ["y"], ints("kernel_shape", [15, 15]),
                     ints("pads", [7, 7, 7, 7])),
            ],
            [tensor("w", 60 * kernel[None, None]), tensor("b", [-6.0])],
            [("x", (1, 1, height, width))],
            [("y", (1, 1, height, width))],
        )
    )  # fmt: skip
