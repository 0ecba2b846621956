"""The name of a file that a browser saves."""

from __future__ import annotations

from urllib.parse import quote

from app.reports.text.naming import ascii_file_name


def attachment(name: str) -> str:
    """Return the header Content-Disposition, with a Latin name for clients without RFC 6266."""
    return f"attachment; filename=\"{ascii_file_name(name)}\"; filename*=UTF-8''{quote(name)}"
