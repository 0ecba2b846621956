"""The server's log: readable lines, or one JSON object a line, each with its request.

No line contains a query string, a token or a cookie: addresses are logged as routes, without their
values.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Literal

LogFormat = Literal["text", "json"]

request_id: ContextVar[str | None] = ContextVar("request_id", default=None)
"""Id of the current request; threads that work for it have it too."""
_inspection: ContextVar[str | None] = ContextVar("inspection", default=None)

_REQUEST_FIELDS = ("method", "route", "status", "duration_ms")
_CHATTY = ("alembic", "uvicorn", "websockets")


def configure(form: LogFormat) -> None:
    """Log from INFO on to standard error."""
    handler = logging.StreamHandler()
    handler.addFilter(_add_context)
    handler.setFormatter(_JsonLines() if form == "json" else _ReadableLines())
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    for name in _CHATTY:
        logging.getLogger(name).setLevel(logging.WARNING)
    logging.getLogger("uvicorn.error").addFilter(_is_no_refusal)


@contextmanager
def about(inspection_id: str | None) -> Iterator[None]:
    """Mark the log lines of the block with this inspection; None marks them with none."""
    before = _inspection.set(inspection_id)
    try:
        yield
    finally:
        _inspection.reset(before)


def _is_no_refusal(record: logging.LogRecord) -> bool:
    """Return False for uvicorn's error about a web socket that was refused with an answer."""
    return record.getMessage() != "ASGI callable returned without completing handshake."


def _add_context(record: logging.LogRecord) -> bool:
    record.request_id, record.inspection = request_id.get(), _inspection.get()
    return True


class _ReadableLines(logging.Formatter):
    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802  (logging's name)
        """Format the line, before a traceback."""
        line = super().formatMessage(record)
        found = getattr(record, "request_id", None)
        return f"{line} [{found}]" if found else line


class _JsonLines(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        """Format one object, without line breaks."""
        fields = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname,
            "logger": record.name,
            "message": record.getMessage(),
        }
        for name in ("inspection", "request_id", *_REQUEST_FIELDS):
            value = getattr(record, name, None)
            if value is not None:
                fields[name] = value
        if record.exc_info:
            fields["trace"] = self.formatException(record.exc_info)
        return json.dumps(fields, ensure_ascii=False, default=str)
