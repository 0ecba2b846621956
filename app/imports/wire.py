"""Encodes what the reading process found in a file, as msgpack with checked types.

Nothing is unpickled, as the process has read an untrusted file (`app.jobs.messages`).
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, get_args

import msgspec
import numpy as np

from app.imports.moved.whole_inspection import Part, WholeInspection
from app.imports.surveys.survey import ImportedFile
from app.survey.distances.stated import Stated
from vo_core import Rig, Track
from vo_core.image.health import Health

_HEALTH = tuple(field.name for field in fields(Health))
_STATUS = np.dtype("S4")
"""ok, weak or lost in fixed length: a quarter of the size of text."""


class Found(msgspec.Struct, frozen=True):
    """The content of a file; one of the two fields is set."""

    surveys: ImportedFile | None = None
    whole: WholeInspection | None = None
    """The inspection without its health, which would take 250 bytes a frame as objects."""
    health: bytes = b""
    """Columns of health in single precision, one after the other."""


def pack(found: ImportedFile | WholeInspection) -> bytes:
    """Encode as a message."""
    if isinstance(found, ImportedFile):
        return _ENCODER.encode(Found(surveys=found))
    columns = [[getattr(row, name) for row in found.health] for name in _HEALTH]
    health = np.array(columns, np.float32).tobytes()
    return _ENCODER.encode(Found(whole=replace(found, health=()), health=health))


def unpack(packed: bytes) -> ImportedFile | WholeInspection:
    """Decode a message.

    Raises:
        ValueError: It is none, or its parts do not match.
    """
    found = _DECODER.decode(packed)
    if found.surveys is not None:
        return found.surveys
    if found.whole is None:
        raise ValueError("nothing was found")
    track = found.whole.track
    if len({len(getattr(track, field.name)) for field in fields(Track)}) != 1:
        raise ValueError("the columns of the track differ in length")
    columns = np.frombuffer(found.health, np.float32).reshape(len(_HEALTH), -1)
    return replace(found.whole, health=[Health(*row) for row in columns.T.tolist()])


def _packed(value: object) -> object:
    if isinstance(value, Rig | Part | Stated):
        return value.model_dump(mode="json")
    if isinstance(value, np.ndarray):
        return (value.astype(_STATUS) if value.dtype.kind == "U" else value).tobytes()
    raise NotImplementedError(f"A {type(value).__name__} has no form on the wire.")


def _unpacked(kind: Any, value: Any) -> object:
    if kind is Rig:
        return Rig.parse(value)
    if issubclass(kind, Part | Stated):
        return kind.model_validate(value)
    # NDArray[np.float64] is ndarray[shape, dtype[float64]].
    (scalar,) = get_args(get_args(kind)[1])
    if scalar is np.str_:
        return np.frombuffer(value, _STATUS).astype(np.str_)
    return np.frombuffer(value, scalar).copy()


_ENCODER = msgspec.msgpack.Encoder(enc_hook=_packed)
_DECODER = msgspec.msgpack.Decoder(Found, dec_hook=_unpacked)
