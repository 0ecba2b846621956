"""What an ONNX file may hold, found by its protobuf messages before anything loads it.

Numbers of fields: https://github.com/onnx/onnx/blob/main/onnx/onnx.proto.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import prod

from app.errors import InvalidDetector

_GRAPH, _FUNCTIONS = 7, 25
_NODES, _TENSORS, _SPARSE = 1, 5, 15
_OP, _ATTRIBUTES = 4, 5
_TENSOR, _SUBGRAPH, _TENSOR_LIST, _SUBGRAPHS = 5, 6, 10, 11
_DIMS, _ELSEWHERE, _LOCATION = 1, 13, 14
_MOST_NODES = 50_000
_VALUES_A_BYTE = 2
"""The smallest types hold two values a byte."""

Field = tuple[int, int | memoryview]


def require_plain(content: bytes) -> None:
    """Require one network without control flow, all of whose values are in the file.

    Raises:
        InvalidDetector: The text says what it has instead.
    """
    whole = memoryview(content)
    graphs = 0
    for number, value in _fields(whole):
        if number == _FUNCTIONS:
            raise InvalidDetector("The model has functions of its own; export it without them.")
        if number == _GRAPH and isinstance(value, memoryview):
            graphs += 1
            _require_graph(value, len(content))
    if graphs != 1:
        raise InvalidDetector("The file is no ONNX model: it has no graph.")


def _require_graph(graph: memoryview, size: int) -> None:
    nodes = 0
    for number, value in _messages(graph):
        if number == _SPARSE:
            raise InvalidDetector("The model has sparse tensors, which are not run.")
        if number == _TENSORS:
            _require_tensor(value, size)
        if number == _NODES:
            nodes += 1
            _require_node(value, size)
    if not 0 < nodes <= _MOST_NODES:
        raise InvalidDetector(f"The model has {nodes} nodes; it may have 1 to {_MOST_NODES}.")


def _require_node(node: memoryview, size: int) -> None:
    fields = list(_messages(node))
    named = (bytes(value).decode("utf-8", "replace") for number, value in fields if number == _OP)
    op = next(named, "")
    for _, attribute in (field for field in fields if field[0] == _ATTRIBUTES):
        for number, value in _messages(attribute):
            if number in (_SUBGRAPH, _SUBGRAPHS):
                raise InvalidDetector(
                    f"The model has control flow ({op:.40}), which is not run. Export it without: "
                    "boxes that overlap are removed here."
                )
            if number in (_TENSOR, _TENSOR_LIST):
                _require_tensor(value, size)


def _require_tensor(tensor: memoryview, size: int) -> None:
    dims: list[int] = []
    for number, value in _fields(tensor):
        if number == _ELSEWHERE or (number == _LOCATION and value):
            raise InvalidDetector("The model keeps values in another file. Export it as one file.")
        if number == _DIMS:
            packed = isinstance(value, memoryview)
            dims += _varints(value) if packed else [value]  # type: ignore[list-item, arg-type]
    if prod(dims) > _VALUES_A_BYTE * size:
        raise InvalidDetector(
            "A tensor of the model announces more values than the file holds: it is damaged."
        )


def _messages(message: memoryview) -> Iterator[tuple[int, memoryview]]:
    for number, value in _fields(message):
        if isinstance(value, memoryview):
            yield number, value


def _fields(message: memoryview) -> Iterator[Field]:
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        number, wire = key >> 3, key & 7
        if wire == 0:
            value, at = _varint(message, at)
            yield number, value
            continue
        if wire == 2:
            length, at = _varint(message, at)
        else:
            length = {1: 8, 5: 4}.get(wire, -1)
        if length < 0 or at + length > len(message):
            raise InvalidDetector("The file is no ONNX model, or was cut off.")
        if wire == 2:
            yield number, message[at : at + length]
        at += length


def _varints(message: memoryview) -> Iterator[int]:
    at = 0
    while at < len(message):
        value, at = _varint(message, at)
        yield value


def _varint(message: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(message):
            break
        byte = message[at]
        at += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, at
    raise InvalidDetector("The file is no ONNX model, or was cut off.")
