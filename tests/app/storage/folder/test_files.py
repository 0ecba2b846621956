"""Files of the data folder are replaced whole, and deleted with what comes meanwhile."""

from __future__ import annotations

import errno
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from app.storage.folder.files import delete_tree, replace_file


def test_a_file_may_be_replaced_by_several_at_once(tmp_path: Path) -> None:
    path, contents = tmp_path / "film.jpg", [bytes([n]) * 10_000 for n in range(16)]
    with ThreadPoolExecutor(len(contents)) as pool:
        for _ in range(20):
            list(pool.map(lambda content: replace_file(path, content), contents))
            assert path.read_bytes() in contents
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_comes_during_the_deletion_goes_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, removed = tmp_path / "inspection", shutil.rmtree
    (folder / "thumbnails").mkdir(parents=True)
    late = ["one.jpg", "two.jpg"]

    def overtaken(path: Path) -> None:
        if late:
            (path / "thumbnails" / late.pop()).write_bytes(b"x")
            raise OSError(errno.ENOTEMPTY, "Directory not empty", str(path))
        removed(path)

    monkeypatch.setattr(shutil, "rmtree", overtaken)
    delete_tree(folder)
    assert not folder.exists()
    delete_tree(folder)  # nothing is there


def test_what_cannot_be_deleted_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path) -> None:
        raise OSError(errno.ENOTEMPTY, "Directory not empty", str(path))

    monkeypatch.setattr(shutil, "rmtree", refused)
    with pytest.raises(OSError, match="not empty"):
        delete_tree(tmp_path)
