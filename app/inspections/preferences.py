"""Each person's choices for the page; people are distinguished by the names of their tokens."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.storage.records.preferences import PreferenceStore

_QUICK_CODES = ("BAB", "BAC", "BAF", "BAJ", "BBA", "BBB", "BBC", "BBF", "BDD")
"""Codes on the digit keys 1 to 9: the most frequent ones, from cracks to the water level."""

DEFAULTS: Mapping[str, Any] = {
    "language": None,
    "units": "m",
    "quick_codes": [{"code": code, "char1": None, "char2": None} for code in _QUICK_CODES],
    "single_keys": True,
    "keys": {},
    "templates": [],
    "pack": None,
}


class Preferences:
    """Reads and replaces preferences."""

    def __init__(self, store: PreferenceStore) -> None:
        self._store = store

    def of(self, who: str) -> dict[str, Any]:
        """Return all preferences, with DEFAULTS for those never chosen."""
        return {**DEFAULTS, **self._store.get(who)}

    def replace(self, who: str, chosen: Mapping[str, Any]) -> None:
        """Replace all preferences.

        Raises:
            PackNotFound: The chosen pack does not exist.
        """
        self._store.put(who, chosen)
