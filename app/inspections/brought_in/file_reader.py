"""Reads the files of other programs in a child process, one at a time."""

from __future__ import annotations

import logging
import signal
from collections.abc import Callable
from pathlib import Path

import msgspec

from app.errors import InvalidImport, InvalidPack
from app.imports import wire
from app.imports.moved.whole_inspection import WholeInspection
from app.imports.surveys.survey import ImportedFile
from app.imports.workbook import Sheets
from app.jobs.messages import Limits
from app.jobs.permits import Permits
from app.jobs.process import Child, Died, Refused, Result, Stalled
from app.jobs.requests.importer import ImportRequest
from app.jobs.requests.workbook import WorkbookRequest

logger = logging.getLogger(__name__)

CPU_S = 120
"""Processor time limit; the largest export takes some 15 s."""
_ANSWER_TIMEOUT_S = 240.0
_WORKBOOK_CPU_S, _WORKBOOK_TIMEOUT_S = 20, 60.0
"""A workbook with as many codes as a pack may have takes 2 s."""
_MOST_ARCHIVES = 2
"""Archive files that are read at once; each may be as large as a film, and others wait."""
_BYTES_A_CPU_S, _BYTES_A_S = 50_000_000, 10_000_000
"""The slowest digest and disk for which a large archive file is waited."""
_TOO_LONG = "Reading the file took longer than any survey needs and was stopped."
_OUT_OF_MEMORY = (
    "Reading the file needs more memory than any survey takes, so it was stopped. Export it "
    "again, in several files if it is large."
)


class FileReader:
    """Reads files under limits; a file that exceeds them is refused, without other effects."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._permits = Permits("Other files are being imported; try again in a moment.")
        self._archives = Permits(
            "Other archive files are being imported; try again in a moment.",
            at_once=_MOST_ARCHIVES,
        )

    def read(self, content: bytes) -> ImportedFile | WholeInspection:
        """Return the content of a file.

        Raises:
            InvalidImport: The file cannot be read within the limits.
            Busy: Other files are being read.
        """
        with self._permits:
            return _read(ImportRequest(self._limits, content), _ANSWER_TIMEOUT_S)

    def read_workbook(self, content: bytes) -> Sheets:
        """Return the sheets of a code pack.

        Raises:
            InvalidPack: The file cannot be read within the limits.
            Busy: Other files are being read.
        """
        limits = msgspec.structs.replace(self._limits, cpu_s=_WORKBOOK_CPU_S)
        request = WorkbookRequest(limits, content)
        with self._permits:
            try:
                return _asked(
                    "app.jobs.requests.workbook",
                    lambda child: child.ask(request, Sheets, stall_s=_WORKBOOK_TIMEOUT_S),
                )
            except InvalidImport as refused:
                raise InvalidPack(str(refused)) from refused

    def read_archive(self, path: Path) -> WholeInspection:
        """Return the inspection of an archive file, and where its files are in it.

        Raises:
            InvalidImport: It cannot be read within the limits.
            Busy: Other archive files are being read.
        """
        size = path.stat().st_size
        limits = msgspec.structs.replace(self._limits, cpu_s=CPU_S + size // _BYTES_A_CPU_S)
        with self._archives:
            request = ImportRequest(limits, archive=str(path))
            found = _read(request, _ANSWER_TIMEOUT_S + size / _BYTES_A_S)
        if not isinstance(found, WholeInspection):
            raise InvalidImport("The file is no archive file of an inspection.")
        return found


def _read(request: ImportRequest, patience_s: float) -> ImportedFile | WholeInspection:
    return _asked(
        "app.jobs.requests.importer",
        lambda child: wire.unpack(child.ask(request, bytes, stall_s=patience_s)),
    )


def _asked(module: str, ask: Callable[[Child], Result]) -> Result:
    """Return the answer of a child, or say as an InvalidImport why there is none."""
    try:
        with Child(module) as child:
            return ask(child)
    except Stalled as error:
        raise InvalidImport(_TOO_LONG) from error
    except Died as death:
        logger.warning("The process that read an import died: %s.", death)
        is_late = death.exit_code == -signal.SIGXCPU
        raise InvalidImport(_TOO_LONG if is_late else _OUT_OF_MEMORY) from death
    except Refused as refusal:
        refusal.log("Import")
        is_short = refusal.code == "out_of_memory"
        raise InvalidImport(_OUT_OF_MEMORY if is_short else str(refusal)) from refusal
    except (msgspec.MsgspecError, ValueError) as error:
        logger.warning("The process that read an import gave an invalid answer: %s", error)
        raise InvalidImport("The file could not be read; details are in the log.") from error
