"""Films in folders: found in order, never outside the allowed ones, whatever their names are."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.archive.folders import folders_in, found_in
from app.archive.paths import path_of, text_of, title_of
from app.archive.patterns import compiled
from app.errors import FolderNotAllowed, NoSuchFilm

EMPTY = "The file is empty (0 bytes)."
NO_FILM = "The file is not a film by its suffix."


def put(path: Path, content: bytes = b"x") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def listed(folder: Path, *allowed: Path) -> dict[str, str | None]:
    """The problem of each file, by its path within the folder."""
    found = found_in([text_of(folder)], allowed or [folder])
    return {each.relative: each.problem for each in found}


def test_every_file_is_named_with_what_is_wrong_with_it(tmp_path: Path) -> None:
    put(tmp_path / "b" / "2.MKV")
    put(tmp_path / "VTS_01_1.VOB")
    put(tmp_path / "a.mp4")
    put(tmp_path / "empty.mp4", b"")
    put(tmp_path / "notes.txt")
    put(tmp_path / ".hidden.mp4")
    os.mkfifo(tmp_path / "pipe.mp4")
    assert list(listed(tmp_path).items()) == [
        ("VTS_01_1.VOB", None), ("a.mp4", None), ("empty.mp4", EMPTY),
        ("notes.txt", NO_FILM), ("pipe.mp4", NO_FILM), ("b/2.MKV", None),
    ]  # fmt: skip


def test_no_link_leads_out_of_the_folders(tmp_path: Path) -> None:
    films, secret = tmp_path / "films", put(tmp_path / "secret" / "s.mp4")
    real = put(films / "real.mp4")
    (films / "link.mp4").symlink_to(secret)
    (films / "folder").symlink_to(secret.parent)
    (films / "same.mp4").symlink_to(real)
    (films / "circle.mp4").symlink_to(films / "circle.mp4")
    (films / "gone.mp4").symlink_to(films / "nothing.mp4")
    found = listed(films)
    assert found.pop("real.mp4") is None
    assert "leads out" in str(found.pop("link.mp4"))
    assert all("cannot be read" in str(found[name]) for name in ("circle.mp4", "gone.mp4"))
    assert len(found) == 2
    for path in (secret, films / ".." / "secret", films / "link.mp4", films / "folder"):
        with pytest.raises(FolderNotAllowed):
            listed(path, films)
    with pytest.raises(NoSuchFilm):
        listed(films / "nothing.mp4", films)


def test_a_folder_is_chosen_among_the_allowed_ones_and_those_in_them(tmp_path: Path) -> None:
    films = tmp_path / "films"
    put(films / "a.mp4")
    put(films / "notes.txt")
    put(films / "south" / "b.mp4")
    put(films / "north" / "deep" / "c.mp4")
    put(films / ".hidden" / "d.mp4")
    (films / "elsewhere").symlink_to(tmp_path)

    first = folders_in(None, [films])
    assert [folder.path for folder in first.folders] == [text_of(films)]
    whole = folders_in(text_of(films), [films])
    assert [folder.name for folder in whole.folders] == ["north", "south"]
    assert (whole.films, whole.above) == (1, None)
    north = folders_in(whole.folders[0].path, [films])
    assert (north.above, north.films) == (text_of(films), 0)
    with pytest.raises(FolderNotAllowed):
        folders_in(text_of(tmp_path), [films])
    with pytest.raises(NoSuchFilm):
        folders_in(text_of(films / "gone"), [films])


def test_no_folder_is_too_deep_and_one_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    put(tmp_path / "a.mp4")
    put(tmp_path / "z" / "c.mp4")
    deep = [tmp_path / "d"]
    for _ in range(1200):
        deep.append(deep[-1] / "d")
    try:
        for folder in deep:
            folder.mkdir()
        put(deep[-1] / "b.mp4")
        names = [path_of(each.path).name for each in found_in([text_of(tmp_path)], [tmp_path])]
        assert names == ["a.mp4", "b.mp4", "c.mp4"]
        relative = (deep[-1] / "b.mp4").relative_to(tmp_path).as_posix()
        assert compiled("d/**/{asset}.mp4").match(relative) == {"asset": "b"}
        (deep[-1] / "b.mp4").unlink()
    finally:
        for folder in reversed(deep):
            folder.rmdir()
    with beyond_the_longest_path(tmp_path / "d"):
        assert listed(tmp_path)["z/c.mp4"] is None
        assert any("cannot be read" in str(each) for each in listed(tmp_path).values())


@contextmanager
def beyond_the_longest_path(folder: Path) -> Iterator[None]:
    """Folders one below the other whose path is longer than any that can be opened."""
    name, levels = 250 * "x", 20
    folder.mkdir()
    handles = [os.open(folder, os.O_RDONLY)]
    for _ in range(levels):
        os.mkdir(name, dir_fd=handles[-1])
        handles.append(os.open(name, os.O_RDONLY, dir_fd=handles[-1]))
    try:
        yield
    finally:
        os.close(handles.pop())
        while handles:
            os.rmdir(name, dir_fd=handles[-1])
            os.close(handles.pop())
        folder.rmdir()


def test_odd_names_come_through_text_unchanged(tmp_path: Path) -> None:
    names = [b"a\nb.mp4", b"\xff\xfe.mp4", b"q'\"`$(x).mp4", "ä.mp4".encode(), b"-rf *.mp4"]
    for name in names:
        put(Path(os.fsdecode(os.fsencode(tmp_path) + b"/" + name)))
    found = list(found_in([text_of(tmp_path)], [tmp_path]))
    assert {os.fsencode(path_of(each.path).name) for each in found} == set(names)
    assert all(each.problem is None for each in found)
    for each in found:
        each.path.encode("utf-8")
        assert path_of(each.path).exists()
        assert title_of(each.path).isprintable()


@given(st.binary(min_size=1, max_size=60).filter(lambda name: not {0, 47} & set(name)))
def test_every_name_has_a_text_and_comes_back(name: bytes) -> None:
    text = text_of(os.fsdecode(name))
    assert os.fsencode(path_of(text)) == name
    assert text.encode("utf-8").decode("utf-8") == text


def test_named_films_are_relative_to_their_common_folder(tmp_path: Path) -> None:
    films = [put(tmp_path / "p" / name) for name in ("a/1.mp4", "b/2.mp4", "b/2.mp4")]
    found = found_in([str(film) for film in films], [tmp_path])
    assert [each.relative for each in found] == ["a/1.mp4", "b/2.mp4"]
