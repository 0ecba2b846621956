"""Which observations are defects, and what counts once.

`static/core/defects/stretches.js` has the same rules.
"""

from __future__ import annotations

START_CODE = "BCD"
"""Code of EN 13508-2 for the start."""
END_CODES = ("BCE", "BDC")
"""Codes of EN 13508-2 for the end, and for a survey that was stopped."""
NO_DEFECTS = (START_CODE, *END_CODES)
"""They say where a survey began and ended."""


def is_defect(code: str | None, severity: int | None) -> bool:
    """Return whether an observation is a defect; a start or an end is one if somebody rated it."""
    return code not in NO_DEFECTS or bool(severity)


def part_of(observation_id: str, continuous: str | None) -> str:
    """Return what an observation is counted with: a stretch such as `A1` to `B1` counts once."""
    return (continuous or "")[1:] or observation_id
