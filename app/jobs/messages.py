"""What parent and child send each other, as msgpack.

A child that decodes hostile media must not be able to run code in the server. So the server
unpickles nothing: every message is decoded into the types that it expects, or refused.
"""

from __future__ import annotations

import msgspec

MAX_MESSAGE_BYTES = 64 * 2**20


class Limits(msgspec.Struct, frozen=True):
    """Limits that a child sets for itself before it opens any media."""

    memory_bytes: int
    cpu_s: int | None = None
    file_bytes: int = 0
    """Largest file that the child may write."""
    reads: tuple[str, ...] = ("/",)
    """Files and folders that the media process may read; other children derive theirs."""


class Part(msgspec.Struct, frozen=True, tag="part"):
    """Child to parent: one of the results before the answer, or progress."""

    value: msgspec.Raw


class Answer(msgspec.Struct, frozen=True, tag="answer"):
    """Child to parent: the answer to a request."""

    value: msgspec.Raw


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """Child to parent: the request failed."""

    code: str
    detail: str
    trace: str = ""
    """For the server's log."""


class Problem(msgspec.Struct, frozen=True):
    """A film was tracked or recorded to its end."""

    sentence: str | None
    """What was wrong with the film or the source; None for nothing."""


class Progress(msgspec.Struct, frozen=True):
    """Frames done, and the total if it is known."""

    done: int
    total: int | None


# Odometry may compute in numpy scalars, which msgpack does not know.
encode = msgspec.msgpack.Encoder(enc_hook=lambda scalar: scalar.item()).encode


def raw(value: object) -> msgspec.Raw:
    """Encode the value of a part or an answer."""
    return msgspec.Raw(encode(value))
