"""Reads a camera from the file of another calibration tool.

- ROS camera_info YAML: plumb_bob and rational_polynomial are pinhole, equidistant is fisheye.
- Kalibr camchain YAML, of cam0: a pinhole with radtan or none is pinhole, with equidistant fisheye.
- OpenCV FileStorage YAML, XML or JSON: pinhole, unless `fisheye_model` says otherwise.
- The camera part of a rig file, as `chainage calibrate` writes it.

All of them state K and the coefficients in OpenCV's order, with pixel centres at integers, as the
rig does.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from vo_core.errors import InvalidRig
from vo_core.rig import Camera

# Other names of the same: OpenCV's interactive calibration, ROS messages, papers.
_MATRIX = ("camera_matrix", "cameraMatrix", "K", "k")
_DISTORTION = ("distortion_coefficients", "dist_coeffs", "distCoeffs", "D", "d")
_WIDTH = ("image_width", "width")
_HEIGHT = ("image_height", "height")
_SIZE_WH = ("cameraResolution", "image_size", "imageSize")

_MODELS = {
    "plumb_bob": "pinhole",
    "rational_polynomial": "pinhole",
    "radtan": "pinhole",
    "none": "pinhole",
    "equidistant": "fisheye",
    "fisheye": "fisheye",
}


def read_camera(path: Path | str) -> Camera:
    """Read intrinsics written by ROS, Kalibr or OpenCV.

    Raises:
        InvalidRig: No such file, another format, or a value is missing or not allowed; the message
            names it and what is accepted.
    """
    path = Path(path)
    try:
        return Camera.parse(_fields(path.read_text("utf-8-sig")), origin=path.name)
    except OSError as error:
        raise InvalidRig(f"{path.name} cannot be read: {error.strerror or error}.") from error
    except ValueError as error:
        raise InvalidRig(f"{path.name} cannot be used. {error}.") from error


def _fields(text: str) -> dict[str, Any]:
    """Convert to the fields of a rig's camera; raises ValueError with a reason for a person."""
    content = _content(text)
    if isinstance(content, Mapping):
        if "fx" in content:
            return dict(json.loads(text))  # numbers as they stand: FileStorage knows floats only
        if isinstance(cam0 := content.get("cam0"), Mapping):
            return _of_kalibr(cam0)
        return _of_opencv(content)
    raise ValueError("it is not of ROS (camera_info), Kalibr (camchain) or OpenCV (FileStorage)")


def _content(text: str) -> Any:
    """Parse to mappings, lists, numbers and words; a matrix becomes rows, cols and data."""
    try:
        if text.lstrip()[:1] in ("<", "{"):
            storage = cv2.FileStorage()
            storage.open(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
            return _plain(storage.root())
        if text.startswith("%YAML"):  # `%YAML:1.0` of OpenCV before 5 is not YAML
            text = text.partition("\n")[2]
        return yaml.load(text, _Loader)  # noqa: S506  (it is a safe one)
    except (cv2.error, yaml.YAMLError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"it is not YAML, XML or JSON ({reason})") from error


class _Loader(yaml.SafeLoader):
    """Loads plain YAML with OpenCV's matrices."""


def _matrix(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    return loader.construct_mapping(node, deep=True)


_Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _matrix)


def _plain(node: cv2.FileNode) -> Any:
    if node.isMap():
        return {name: _plain(node.getNode(name)) for name in node.keys()}  # noqa: SIM118
    if node.isSeq():
        return [_plain(node.at(i)) for i in range(node.size())]
    return node.string() if node.isString() else node.real()


def _of_kalibr(camera: Mapping[str, Any]) -> dict[str, Any]:
    lens = _value(camera, "camera_model")
    if lens != "pinhole":
        raise ValueError(f"camera_model is {lens!r}; only pinhole is accepted")
    fx, fy, cx, cy = _numbers(camera, "intrinsics", count=4)
    width, height = _sizes(camera, "resolution", count=2)
    return {
        "model": _model(_value(camera, "distortion_model")),
        "width": width,
        "height": height,
        "fx": fx,
        "fy": fy,
        "cx": cx,
        "cy": cy,
        "distortion": _numbers(camera, "distortion_coeffs"),
    }


def _of_opencv(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Convert files of OpenCV and ROS; in those of ROS a field names the distortion model."""
    fx, skew, cx, _, fy, cy, *_ = _numbers(fields, *_MATRIX, count=9)
    if any(name in fields for name in _SIZE_WH):
        width, height = _sizes(fields, *_SIZE_WH, count=2)
    else:
        (width,) = _sizes(fields, *_WIDTH, count=1)
        (height,) = _sizes(fields, *_HEIGHT, count=1)
    unnamed = "fisheye" if fields.get("fisheye_model") else "plumb_bob"
    return {
        "model": _model(fields.get("distortion_model", unnamed)),
        "width": width,
        "height": height,
        "fx": fx,
        "fy": fy,
        "cx": cx,
        "cy": cy,
        "skew": skew,
        "distortion": _numbers(fields, *_DISTORTION),
    }


def _model(distortion: object) -> str:
    model = _MODELS.get(str(distortion))
    if model is None:
        raise ValueError(f"distortion_model is {distortion!r}; accepted are {', '.join(_MODELS)}")
    return model


def _sizes(fields: Mapping[str, Any], *names: str, count: int) -> list[float]:
    """Convert whole numbers to int: files of OpenCV have floats, which the rig rejects."""
    numbers = _numbers(fields, *names, count=count)
    return [int(number) if number.is_integer() else number for number in numbers]


def _numbers(fields: Mapping[str, Any], *names: str, count: int | None = None) -> list[float]:
    """Flatten a number, a list, rows, or a mapping of rows, cols and data, row by row."""
    value = _value(fields, *names)
    try:
        if isinstance(value, Mapping):
            # Words are converted too, because 1e-05 is a word in YAML 1.1.
            matrix = np.array(value["data"], np.float64)
            matrix = matrix.reshape(int(value["rows"]), int(value["cols"]))
        else:
            matrix = np.array(value, np.float64)
    except (KeyError, ValueError, TypeError) as error:
        raise ValueError(f"{names[0]} must be a matrix of numbers, but is {value!r}") from error
    if count is not None and matrix.size != count:
        raise ValueError(f"{names[0]} must hold {count} numbers, but has {matrix.size}")
    return [float(number) for number in matrix.flat]


def _value(fields: Mapping[str, Any], *names: str) -> Any:
    """Look up the first of the names that is present."""
    for name in names:
        if name in fields:
            return fields[name]
    also = f" (also accepted: {', '.join(names[1:])})" if names[1:] else ""
    raise ValueError(f"{names[0]} is missing{also}")
