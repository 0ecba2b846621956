"""The models of users: checked in a child process when they come, kept as blobs."""

from __future__ import annotations

import logging
import secrets
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from app.errors import InvalidDetector
from app.inspections.films.uploads import Uploads
from app.jobs.messages import Limits
from app.jobs.permits import Permits
from app.jobs.process import Child, Died, Refused, Stalled
from app.jobs.requests.finder import FinderRequest, ModelFile
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.folder.files import sha256_of
from app.storage.records.detectors import DetectorRow, DetectorStore
from app.survey.findings.declaration import Declaration, read_declaration

logger = logging.getLogger(__name__)

FINDER = "app.jobs.requests.finder"
CPU_S = 60
"""Processor time of a check, which runs the model once."""
_STALL_S = 90.0
_TOO_SLOW = (
    f"The model takes more than {CPU_S} s of processor time for one picture, so it was stopped."
)
MOST_BYTES = 256 * 2**20


@dataclass(frozen=True)
class DetectorView:
    """A model with its declaration."""

    row: DetectorRow

    @property
    def declared(self) -> Declaration:
        """What its file declares; it was checked when it came."""
        return Declaration.model_validate(self.row.declared)

    @property
    def version(self) -> str:
        """The beginning of its digest."""
        return self.row.sha256[:8]


class Detectors:
    """Checks, lists and deletes models, and hands their files to who runs them."""

    def __init__(
        self, store: DetectorStore, uploads: Uploads, blobs: Blobs, limits: Limits
    ) -> None:
        self._store = store
        self._uploads = uploads
        self._blobs = blobs
        self._limits = limits
        self._permits = Permits("Another model is being checked; try again in a moment.")

    def all(self) -> list[DetectorView]:
        """Return the models, sorted by name."""
        return [DetectorView(row) for row in self._store.all()]

    def get(self, detector_id: str) -> DetectorView:
        """Return a model; raise DetectorNotFound if there is none."""
        return DetectorView(self._store.get(detector_id))

    def add(self, upload_id: str, declaration: str, who: str) -> DetectorView:
        """Check a model, and keep it.

        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InvalidDetector: It cannot be used; the text says what to do.
            DetectorNameTaken: Another one has its name.
            Busy: Another model is being checked.
        """
        declared = read_declaration(declaration)
        self._store.require_free(declared.name)
        with self._permits, self._uploads.take(upload_id) as (path, info):
            if info.length > MOST_BYTES:
                raise InvalidDetector(
                    f"The model has {info.length} bytes; it may have {MOST_BYTES}."
                )
            self._check(path, declared)
            row = DetectorRow(
                id=secrets.token_hex(16),
                name=declared.name,
                sha256=sha256_of(path),
                size=info.length,
                declared=declared.model_dump(),
                created_at=datetime.now(UTC),
                created_by=who,
            )
            self._blobs.put_file(keys.detector(row.id), path)
            try:
                self._store.add(row)
            except BaseException:
                self._blobs.delete(keys.detector(row.id))
                raise
        logger.info("Model %s (%s) by %s.", row.id, row.name, who)
        return DetectorView(row)

    def delete(self, detector_id: str) -> None:
        """Delete a model; raise DetectorNotFound if there is none."""
        self._store.delete(detector_id)
        self._blobs.delete(keys.detector(detector_id))

    @contextmanager
    def opened(self, detector_id: str) -> Iterator[tuple[DetectorView, ModelFile]]:
        """Hold the file of a model.

        Raises:
            DetectorNotFound, BlobNotFound: It was deleted.
        """
        view = self.get(detector_id)
        with self._blobs.local(keys.detector(detector_id)) as path:
            yield view, _file(path, view.declared)

    def _check(self, path: Path, declared: Declaration) -> None:
        request = FinderRequest(self._limits, model=_file(path, declared), is_check=True)
        try:
            with Child(FINDER) as child:
                child.ask(request, str, stall_s=_STALL_S)
        except Stalled as error:
            raise InvalidDetector(_TOO_SLOW) from error
        except Died as death:
            if death.exit_code == -signal.SIGXCPU:
                raise InvalidDetector(_TOO_SLOW) from death
            raise InvalidDetector(f"The process that tried out the model died: {death}.") from death
        except Refused as refusal:
            refusal.log("A model")
            raise InvalidDetector(str(refusal)) from refusal


def _file(path: Path, declared: Declaration) -> ModelFile:
    return ModelFile(str(path), declared.model_dump_json().encode())
