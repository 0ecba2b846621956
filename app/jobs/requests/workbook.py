"""The process that reads the workbook of a code pack, then ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

from app.jobs.child import Parent, serve
from app.jobs.messages import Limits

if TYPE_CHECKING:
    from app.imports.workbook import Sheets


class WorkbookRequest(msgspec.Struct, frozen=True):
    """Read a workbook; the answer is its `Sheets`."""

    limits: Limits
    content: bytes


def _read(request: WorkbookRequest, _parent: Parent) -> Sheets:
    # Imported here so that the reader is loaded under the limits.
    from app.imports import workbook

    return workbook.read(request.content)


def main() -> None:
    """Answer the one request."""
    serve(WorkbookRequest, _read, named="Reading the workbook")


if __name__ == "__main__":
    main()
