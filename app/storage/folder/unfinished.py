"""Marks inspections whose files are stored before their rows: a crash leaves nothing half."""

from __future__ import annotations

import fcntl
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from app.errors import Busy, StoreUnavailable
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.folder.files import Places, sync_folder

logger = logging.getLogger(__name__)

_MARK, _FILM = ".importing", ".import"


class Unfinished:
    """One file for each inspection that is being made; who makes it holds a lock on the file."""

    def __init__(self, places: Places, blobs: Blobs, is_known: Callable[[str], bool]) -> None:
        """Use the folder of the inspections.

        Args:
            places: The data folder.
            blobs: Where the files are.
            is_known: Whether an inspection of this id exists or ever existed.
        """
        self._folder = places.inspections
        self._blobs = blobs
        self._is_known = is_known

    @contextmanager
    def making(self, inspection_id: str) -> Iterator[None]:
        """Hold the mark of a new inspection; if the block fails, its files are deleted.

        If the block fails because the database was too slow to say whether it committed, they stay
        until the next start.

        Raises:
            FileExistsError: There is or was one of this id, or it is being made already.
        """
        path = self._folder / f"{inspection_id}{_MARK}"
        with path.open("xb") as mark:
            fcntl.flock(mark, fcntl.LOCK_EX)
            sync_folder(self._folder)
            if self._is_known(inspection_id) or self._has_files(inspection_id):
                path.unlink()
                raise FileExistsError(inspection_id)
            try:
                yield
            except Busy:
                # Its rows may be committed nevertheless; the next start sees whether they are.
                raise
            except BaseException:
                # What cannot be deleted now is deleted at the next start.
                with suppress(OSError, StoreUnavailable):
                    self._delete(inspection_id)
                raise
            path.unlink()

    def delete_all(self) -> None:
        """Delete what servers that have ended left; call it at the start."""
        for path in sorted(self._folder.glob(f"*{_MARK}")):
            with suppress(FileNotFoundError), path.open("rb") as mark:
                try:
                    fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    continue  # another server of this folder is making it
                self._delete_left(path.name.removesuffix(_MARK))

    def _delete_left(self, inspection_id: str) -> None:
        if self._is_known(inspection_id):
            (self._folder / f"{inspection_id}{_MARK}").unlink(missing_ok=True)
            return
        logger.warning("Import %s was interrupted; what is left of it is deleted.", inspection_id)
        try:
            self._delete(inspection_id)
        except (OSError, StoreUnavailable) as error:
            logger.warning("It cannot be deleted now: %s", error)

    def _has_files(self, inspection_id: str) -> bool:
        return any(True for _ in self._blobs.listed(keys.inspection(inspection_id)))

    def _delete(self, inspection_id: str) -> None:
        (self._folder / f"{inspection_id}{_FILM}").unlink(missing_ok=True)
        self._blobs.delete_all(keys.inspection(inspection_id))
        (self._folder / f"{inspection_id}{_MARK}").unlink(missing_ok=True)
