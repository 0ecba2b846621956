"""Versions in headers: what an answer holds is its `ETag`, what a change was made of `If-Match`."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Header, Response


def tag_with(response: Response, version: str) -> None:
    """Name the version that an answer holds."""
    response.headers["ETag"] = etag(version)


def etag(version: str) -> str:
    """A version as the headers have it."""
    return f'"{version}"'


def _replaced(
    if_match: Annotated[
        str | None,
        Header(
            description="The `ETag` of what the change was made of: if something else is stored by "
            "now, nothing is changed, and the answer is 412 with both. Without it, the change "
            "replaces whatever there is."
        ),
    ] = None,
) -> str | None:
    return None if if_match is None else if_match.strip().removeprefix('"').removesuffix('"')


Replaced = Annotated[str | None, Depends(_replaced)]
"""Version that a change was made of; None replaces whatever there is."""
