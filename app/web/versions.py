"""Versions in headers: `ETag` is that of the answer, `If-Match` the one a change was based on."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Header, Response


def tag_with(response: Response, version: str) -> None:
    """Set the version of an answer."""
    response.headers["ETag"] = etag(version)


def etag(version: str) -> str:
    """Format a version for headers."""
    return f'"{version}"'


def _replaced(
    if_match: Annotated[
        str | None,
        Header(
            description="The `ETag` that the change was based on. If another version is stored by "
            "now, nothing changes, and the answer is 412 with both versions. Without it, the "
            "change replaces any version."
        ),
    ] = None,
) -> str | None:
    return None if if_match is None else if_match.strip().removeprefix('"').removesuffix('"')


Replaced = Annotated[str | None, Depends(_replaced)]
"""Version that the change was based on; None replaces any version."""
