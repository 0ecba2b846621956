"""Versions of what people edit: a change may name the version it was based on, so that none is
lost.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Any

from app.errors import ChangedMeanwhile

Require = Callable[[Any], None]
"""Called within the transaction with what is stored; raises if that is not what was edited."""


def require_version(
    current: Mapping[str, Any] | None, yours: Mapping[str, Any] | None, replaced: str | None
) -> None:
    """Raise ChangedMeanwhile if a change was based on something else than what is stored.

    A change that is already stored, such as one sent again after a lost answer, is accepted.

    Args:
        current: What is stored, None if nothing is.
        yours: The new content, None to delete it.
        replaced: Version that the change was based on; None replaces any version.
    """
    if replaced is None or current == yours:
        return
    if current is None or version_of(current) != replaced:
        raise ChangedMeanwhile(current, yours)


def version_of(stored: Any) -> str:
    """Return a short name of the content: equal content has equal names."""
    content = json.dumps(stored, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()[:16]
