"""A film is copied if it is, and stays, the file that was added."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from app.archive.copying import copy_film
from app.archive.folders import modified_at
from app.errors import FilmChanged, FilmMissing

CONTENT = os.urandom(9 * 2**20)


@pytest.fixture
def film(tmp_path: Path) -> Path:
    path = tmp_path / "film.mp4"
    path.write_bytes(CONTENT)
    return path


def copied(film: Path, meanwhile: Callable[[int], None]) -> Path:
    """Copy the film as it was added before `meanwhile` was called with 0."""
    status = film.stat()
    meanwhile(0)
    copy = film.with_suffix(".import")
    copy_film(film, copy, status.st_size, modified_at(status), meanwhile)
    return copy


def test_the_copy_is_the_film_and_its_progress_is_reported(film: Path) -> None:
    done: list[int] = []
    assert copied(film, done.append).read_bytes() == CONTENT
    assert done == [0, 4 * 2**20, 8 * 2**20, 9 * 2**20]


def test_a_copy_that_is_no_longer_wanted_ends(film: Path) -> None:
    def meanwhile(done: int) -> None:
        if done:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        copied(film, meanwhile)


@pytest.mark.parametrize("at", [0, 4 * 2**20])
def test_a_film_that_changes_is_refused(film: Path, at: int) -> None:
    def meanwhile(done: int) -> None:
        if done == at:
            with film.open("ab") as writer:
                writer.write(b"more")

    with pytest.raises(FilmChanged, match=str(len(CONTENT) + 4)):
        copied(film, meanwhile)


@pytest.mark.parametrize("place", ["film", "folder"])
def test_nothing_else_in_its_place_is_read(tmp_path: Path, place: str) -> None:
    real = tmp_path / "real"
    (real / "a").mkdir(parents=True)
    (real / "a" / "film.mp4").write_bytes(CONTENT)
    film = tmp_path / "a" / "film.mp4"
    film.parent.mkdir()
    film.write_bytes(CONTENT)

    def meanwhile(done: int) -> None:
        if done == 0:
            film.unlink()
            if place == "folder":
                film.parent.rmdir()
                film.parent.symlink_to(real / "a")
            else:
                film.symlink_to(real / "a" / "film.mp4")

    with pytest.raises((FilmChanged, FilmMissing)):
        copied(film, meanwhile)


def test_a_pipe_in_its_place_blocks_nothing(film: Path) -> None:
    def meanwhile(done: int) -> None:
        film.unlink()
        os.mkfifo(film)

    with pytest.raises(FilmChanged):
        copied(film, meanwhile)
