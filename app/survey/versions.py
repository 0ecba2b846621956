"""Versions of what people edit: a change may name the one it was made of, so that none is lost."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from typing import Any

Require = Callable[[Any], None]
"""Called within the transaction with what is stored; raises if that is not what was changed."""


def version_of(stored: Any) -> str:
    """A short name that the same content has always, and other content never."""
    content = json.dumps(stored, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()[:16]
