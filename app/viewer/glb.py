"""Builds binary glTF 2.0 of a mesh with one JPEG, which the browser decodes and the server does
not.
"""

from __future__ import annotations

import json
import struct

import numpy as np
from numpy.typing import NDArray

from app.viewer.geometry import Mesh

_MAGIC, _VERSION = 0x46546C67, 2
_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_FLOAT, _UNSIGNED_SHORT = 5126, 5123
_UNLIT = "KHR_materials_unlit"
_CLAMP_TO_EDGE, _LINEAR, _LINEAR_MIPMAP_LINEAR = 33071, 9729, 9987


def textured_glb(mesh: Mesh, uv: NDArray[np.float64], jpeg: bytes) -> bytes:
    """Return the file of a mesh of at most 65,535 vertices, visible from its front only.

    Args:
        mesh: A mesh in any unit; the coordinates are copied unchanged.
        uv: (V, 2), u along the columns of the picture and v down its rows, both from 0 to 1.
        jpeg: The picture, copied unchanged.
    """
    positions = np.asarray(mesh.vertices, "<f4")
    parts = [
        positions.tobytes(),
        np.asarray(uv, "<f4").tobytes(),
        np.asarray(mesh.faces, "<u2").tobytes(),
        jpeg,
    ]
    views, offset = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
        offset += _padded(len(part))
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [_UNLIT],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}
                ]
            }
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                "alphaMode": "MASK",
                # Unlit, as bright as it was seen; without a graphics card, lighting costs most.
                "extensions": {_UNLIT: {}},
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [
            {
                "wrapS": _CLAMP_TO_EDGE,
                "wrapT": _CLAMP_TO_EDGE,
                "magFilter": _LINEAR,
                "minFilter": _LINEAR_MIPMAP_LINEAR,
            }
        ],
        "images": [{"bufferView": 3, "mimeType": "image/jpeg"}],
        "accessors": [
            _accessor(0, _FLOAT, "VEC3", len(positions))
            | {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()},
            _accessor(1, _FLOAT, "VEC2", len(positions)),
            _accessor(2, _UNSIGNED_SHORT, "SCALAR", mesh.faces.size),
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": offset}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    chunks = _chunk(_JSON_CHUNK, text, b" ") + _chunk(
        _BINARY_CHUNK, b"".join(part.ljust(_padded(len(part)), b"\0") for part in parts), b"\0"
    )
    return struct.pack("<III", _MAGIC, _VERSION, 12 + len(chunks)) + chunks


def _accessor(view: int, component: int, kind: str, count: int) -> dict[str, object]:
    return {"bufferView": view, "componentType": component, "type": kind, "count": count}


def _chunk(kind: int, content: bytes, filler: bytes) -> bytes:
    padded = content.ljust(_padded(len(content)), filler)
    return struct.pack("<II", len(padded), kind) + padded


def _padded(length: int) -> int:
    """Round up to a multiple of four bytes, where every part of the format begins."""
    return (length + 3) // 4 * 4
