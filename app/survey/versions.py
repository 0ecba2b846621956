"""Versions of what people edit: a change may name the one it was made of, so that none is lost."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Any

from app.errors import ChangedMeanwhile

Require = Callable[[Any], None]
"""Called within the transaction with what is stored; raises if that is not what was changed."""


def require_version(
    current: Mapping[str, Any] | None, yours: Mapping[str, Any], replaced: str | None
) -> None:
    """Raise ChangedMeanwhile if a change was made of something else than what is stored.

    A change that is there already, as one that is sent again for want of an answer, is none.

    Args:
        current: What is stored, None if nothing is.
        yours: What it is changed to.
        replaced: Version of what it was made of; None replaces whatever there is.
    """
    if replaced is None or current == yours:
        return
    if current is None or version_of(current) != replaced:
        raise ChangedMeanwhile(current, yours)


def version_of(stored: Any) -> str:
    """A short name that the same content has always, and other content never."""
    content = json.dumps(stored, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()[:16]
