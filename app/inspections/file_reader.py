"""Reads the files of other programs in a child process, one at a time."""

from __future__ import annotations

import logging
import signal
import threading

import msgspec

from app.errors import Busy, InvalidImport
from app.imports import wire
from app.imports.survey import ImportedFile
from app.imports.whole_inspection import WholeInspection
from app.jobs.importer import OUT_OF_MEMORY
from app.jobs.messages import Failed, Limits
from app.jobs.process import Child, describe_exit

logger = logging.getLogger(__name__)

CPU_S = 120
"""Processor time limit; the largest export takes some 15 s."""
_ANSWER_TIMEOUT_S = 240.0
_WAIT_FOR_TURN_S = 60.0
_TOO_LONG = "Reading the file took longer than any survey needs and was stopped."


class FileReader:
    """Reads files under limits; a file that exceeds them is refused, without other effects."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._turn = threading.Lock()
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
            return self._found(self._exchange(content))
        finally:
            self._turn.release()

    def _exchange(self, content: bytes) -> bytes:
        child = Child("app.jobs.importer")
        try:
            child.send(self._limits)
            child.send_bytes(content)
            return child.receive(_ANSWER_TIMEOUT_S)
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
