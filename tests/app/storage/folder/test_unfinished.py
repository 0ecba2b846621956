"""Files of inspections that were being made when something failed."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.errors import Busy, DiskFull
from app.storage.blobs import keys
from app.storage.blobs.folder import FolderBlobs
from app.storage.folder.files import Places
from app.storage.folder.unfinished import Unfinished

NAME = "0123456789abcdef0123456789abcdef"


class Made:
    """An inspection whose rig is stored, and whose rows fail."""

    def __init__(self, root: Path, failure: Exception) -> None:
        self.places = Places(root)
        self.places.inspections.mkdir()
        self.blobs = FolderBlobs(root)
        with pytest.raises(type(failure)):
            self._make(failure)

    def _make(self, failure: Exception) -> None:
        with Unfinished(self.places, self.blobs, lambda _: False).making(NAME):
            self.blobs.put(keys.rig(NAME), b"{}")
            raise failure

    def start_again(self, *, is_committed: bool) -> None:
        """Do what the next start of a server does."""
        Unfinished(self.places, self.blobs, lambda _: is_committed).delete_all()

    @property
    def has_files(self) -> bool:
        return self.blobs.exists(keys.rig(NAME))

    @property
    def is_marked(self) -> bool:
        return any(self.places.inspections.glob("*.importing"))


def test_files_go_with_an_inspection_that_cannot_be_made(tmp_path: Path) -> None:
    made = Made(tmp_path, DiskFull("There is no room."))
    assert (made.has_files, made.is_marked) == (False, False)


@pytest.mark.parametrize("is_committed", [True, False])
def test_files_stay_until_it_is_known_whether_the_rows_were_committed(
    tmp_path: Path, is_committed: bool
) -> None:
    made = Made(tmp_path, Busy("The database is not keeping up."))
    assert (made.has_files, made.is_marked) == (True, True)
    made.start_again(is_committed=is_committed)
    assert (made.has_files, made.is_marked) == (is_committed, False)
