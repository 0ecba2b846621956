"""What a format of the report is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from app.reports.report import Loss, Report, Written


class SurveyFile(Protocol):
    """An exchange file that is being written; of its inspections it keeps what it writes only."""

    def add(self, report: Report, /) -> tuple[Loss, ...]:
        """Add an inspection, and return what the format cannot hold of it."""

    def content(self) -> bytes:
        """Return the file with all that was added."""


@dataclass(frozen=True)
class Format:
    """One output format of the report."""

    stem: str
    """Stem of the file's name, after the inspection's name."""
    suffix: str
    media_type: str
    write: Callable[[Report], Written]
    survey_file: Callable[[], SurveyFile] | None = None
    """Begins an exchange file of one inspection or several; None for other formats."""
    losses_of: Callable[[Report], tuple[Loss, ...]] | None = None
    """Finds what the format cannot hold, where that takes less than writing it."""

    def losses(self, report: Report) -> tuple[Loss, ...]:
        """Return what the format cannot hold.

        Raises:
            ExportNotAvailable: The inspection lacks what the format needs.
        """
        if self.losses_of is not None:
            return self.losses_of(report)
        written = self.write(report)
        if written.file is not None:
            written.file.close()
        return written.losses
