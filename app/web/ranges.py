"""Answers with a blob or with ranges of it (RFC 9110, section 14), read while they are sent."""

from __future__ import annotations

import re
import secrets
from collections.abc import Iterator, Mapping, Sequence

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, Response, StreamingResponse

from app.storage.blobs.blobs import StoredBlob

PRIVATE = {"Cache-Control": "private, no-cache", "Content-Security-Policy": "sandbox"}
"""Headers of films, photos and voice notes."""
_MOST_RANGES = 100
_RANGE = re.compile(r"(\d{1,18})-(\d{1,18})?|-(\d{1,18})")

Ranges = list[tuple[int, int]]
"""First byte and end of each."""


def blob_response(
    request: Headers, blob: StoredBlob, media_type: str, headers: Mapping[str, str]
) -> Response:
    """Return the answer to a GET.

    Args:
        request: Headers of the request; Range and If-Range are followed.
        blob: A blob that may still be growing: bytes added from now on are left out.
        media_type: Of the blob.
        headers: Further headers of the answer.
    Raises:
        BlobNotFound: There is no blob.
    """
    about = blob.about()
    etag = f'"{about.revision:x}-{about.size:x}"'
    common = {**headers, "Accept-Ranges": "bytes", "ETag": etag}
    ranges = None
    if request.get("if-range", etag) == etag:
        ranges = _asked(request.get("range", ""), about.size)
    if ranges is None:
        return _answer(200, blob.blocks(0, about.size), about.size, media_type, common)
    if not ranges:
        unsatisfied = {"Content-Range": f"bytes */{about.size}"}
        return PlainTextResponse(status_code=416, headers=unsatisfied)
    if len(ranges) == 1:
        ((first, end),) = ranges
        common["Content-Range"] = _content_range(first, end, about.size)
        return _answer(206, blob.blocks(first, end - first), end - first, media_type, common)
    boundary = secrets.token_hex(16)
    heads = [
        f"\r\n--{boundary}\r\nContent-Type: {media_type}\r\n"
        f"Content-Range: {_content_range(first, end, about.size)}\r\n\r\n".encode("latin-1")
        for first, end in ranges
    ]
    foot = f"\r\n--{boundary}--\r\n".encode("latin-1")
    length = sum(end - first for first, end in ranges) + sum(map(len, (*heads, foot)))
    parts = _parts(blob, ranges, heads, foot)
    return _answer(206, parts, length, f"multipart/byteranges; boundary={boundary}", common)


def _answer(
    status: int, body: Iterator[bytes], length: int, media_type: str, headers: Mapping[str, str]
) -> Response:
    return StreamingResponse(
        body, status, {**headers, "Content-Length": str(length)}, media_type=media_type
    )


def _content_range(first: int, end: int, size: int) -> str:
    return f"bytes {first}-{end - 1}/{size}"


def _parts(
    blob: StoredBlob, ranges: Ranges, heads: Sequence[bytes], foot: bytes
) -> Iterator[bytes]:
    for (first, end), head in zip(ranges, heads, strict=True):
        yield head
        yield from blob.blocks(first, end - first)
    yield foot


def _asked(header: str, size: int) -> Ranges | None:
    """Return the satisfiable ranges, in order and merged where they touch.

    None if the whole blob is asked for, also by a header that is invalid or names too many ranges;
    none at all if there is nothing that could be sent.
    """
    unit, _, listed = header.partition("=")
    found = [_RANGE.fullmatch(part.strip()) for part in listed.split(",")]
    if unit.strip().lower() != "bytes" or len(found) > _MOST_RANGES:
        return None
    ranges = []
    for match in found:
        if match is None:
            return None
        first, last, suffix = match.groups()
        if first is None:
            begin, end = max(size - int(suffix), 0), size
        elif last is not None and int(last) < int(first):
            return None
        else:
            begin, end = int(first), min(int(last or size) + 1, size)
        if begin < end:
            ranges.append((begin, end))
    return _merged(ranges)


def _merged(ranges: Ranges) -> Ranges:
    merged: Ranges = []
    for first, end in sorted(ranges):
        if merged and first <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((first, end))
    return merged
