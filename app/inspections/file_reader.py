"""Reads the files of other programs in a child process, one at a time."""

from __future__ import annotations

import logging
import signal
import threading
from pathlib import Path

import msgspec

from app.errors import Busy, InvalidImport
from app.imports import wire
from app.imports.survey import ImportedFile
from app.imports.whole_inspection import WholeInspection
from app.jobs.messages import Failed, Limits
from app.jobs.process import Child, describe_exit
from app.jobs.requests.importer import OUT_OF_MEMORY

logger = logging.getLogger(__name__)

CPU_S = 120
"""Processor time limit; the largest export takes some 15 s."""
_ANSWER_TIMEOUT_S = 240.0
_WAIT_FOR_TURN_S = 60.0
_MOST_ARCHIVES = 2
"""Archive files that are read at once; each may be as large as a film, and others wait."""
_BYTES_A_CPU_S, _BYTES_A_S = 50_000_000, 10_000_000
"""The slowest digest and disk for which a large archive file is waited."""
_TOO_LONG = "Reading the file took longer than any survey needs and was stopped."


class FileReader:
    """Reads files under limits; a file that exceeds them is refused, without other effects."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._turn = threading.Lock()
        self._archives = threading.BoundedSemaphore(_MOST_ARCHIVES)
        self._answers = wire.decoder(wire.Found | Failed)

    def read(self, content: bytes) -> ImportedFile | WholeInspection:
        """Return the content of a file.

        Raises:
            InvalidImport: The file cannot be read within the limits.
            Busy: Other files are being read.
        """
        if not self._turn.acquire(timeout=_WAIT_FOR_TURN_S):
            raise Busy("Other files are being imported; try again in a moment.")
        try:
            child = Child("app.jobs.requests.importer")
            return self._found(self._exchange(child, self._limits, content, _ANSWER_TIMEOUT_S))
        finally:
            self._turn.release()

    def read_archive(self, path: Path) -> WholeInspection:
        """Return the inspection of an archive file, and where its files are in it.

        Raises:
            InvalidImport: It cannot be read within the limits.
            Busy: Other archive files are being read.
        """
        size = path.stat().st_size
        limits = msgspec.structs.replace(
            self._limits, reads=(str(path),), cpu_s=CPU_S + size // _BYTES_A_CPU_S
        )
        if not self._archives.acquire(timeout=_WAIT_FOR_TURN_S):
            raise Busy("Other archive files are being imported; try again in a moment.")
        try:
            child = Child("app.jobs.requests.archive_importer")
            patience_s = _ANSWER_TIMEOUT_S + size / _BYTES_A_S
            found = self._found(self._exchange(child, limits, None, patience_s))
        finally:
            self._archives.release()
        if not isinstance(found, WholeInspection):
            raise InvalidImport("The file is no archive file of an inspection.")
        return found

    def _exchange(
        self, child: Child, limits: Limits, content: bytes | None, patience_s: float
    ) -> bytes:
        try:
            child.send(limits)
            if content is not None:
                child.send_bytes(content)
            return child.receive(patience_s)
        except TimeoutError as error:
            raise InvalidImport(_TOO_LONG) from error
        except (EOFError, OSError) as error:
            code = child.end()
            logger.warning("The process that read an import died: %s.", describe_exit(code))
            raise InvalidImport(_TOO_LONG if code == -signal.SIGXCPU else OUT_OF_MEMORY) from error
        finally:
            child.kill()

    def _found(self, answer: bytes) -> ImportedFile | WholeInspection:
        try:
            message = self._answers.decode(answer)
            if isinstance(message, wire.Found):
                return wire.unpack(message)
        except (msgspec.MsgspecError, ValueError) as error:
            logger.warning("The process that read an import gave an invalid answer: %s", error)
            raise InvalidImport("The file could not be read; details are in the log.") from error
        if message.code != "invalid_import":
            logger.error("Import: %s %s", message.detail, message.trace)
        raise InvalidImport(message.detail)
