"""An exchange file that holds one inspection or several."""

from __future__ import annotations

from typing import Protocol

from app.reports.report import Loss, Report, Written


class SurveyFile(Protocol):
    """Such a file while it is being written; of its inspections it keeps what it writes only."""

    def add(self, report: Report, /) -> tuple[Loss, ...]:
        """Add an inspection, and return what the format cannot hold of it."""

    def content(self) -> bytes:
        """Return the file with all that was added."""


def of_one(file: SurveyFile, report: Report) -> Written:
    """Write a file of one inspection."""
    losses = file.add(report)
    return Written(file.content(), losses)
