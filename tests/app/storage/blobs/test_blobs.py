"""The same demands on both stores of blobs: a folder, and a bucket of a real S3 server."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import pytest
from object_stores import Line

from app.errors import BlobNotFound, DiskFull, InvalidSettings, StoreUnavailable
from app.storage.blobs.blobs import blocks
from app.storage.blobs.stores import blobs_at

FILM = "inspections/00ff/video.mp4"
LARGE = 19 * 2**20
"""More than two parts of an upload."""


@pytest.fixture(params=["folder", "s3"])
def url(request):
    """The URL of a store; none stands for the data folder."""
    if request.param == "folder":
        return None
    return request.getfixturevalue("object_store").new()


@pytest.fixture
def blobs(url, tmp_path):
    return blobs_at(url, tmp_path / "data")


@pytest.fixture
def line(object_store):
    """A line to the S3 server."""
    line = Line(object_store.port)
    yield line
    line.cut()


def file_of(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def keys_of(blobs, folder):
    return [blob.key for blob in blobs.listed(folder)]


def test_a_blob_is_what_was_put_last(blobs):
    blobs.put(FILM, b"first")
    before = blobs.about(FILM)
    blobs.put(FILM, b"second")
    assert blobs.get(FILM) == b"second"
    assert blobs.about(FILM).size == 6
    assert blobs.about(FILM).revision not in (before.revision, None)
    assert 0 <= blobs.about(FILM).revision < 2**53
    assert blobs.exists(FILM)


def test_an_empty_blob_is_one(blobs):
    blobs.put(FILM, b"")
    assert blobs.get(FILM) == b""
    assert list(blocks(blobs, FILM, 0, 0)) == []
    with blobs.local(FILM) as path:
        assert path.read_bytes() == b""


def test_a_blob_that_can_be_made_again_is_there_at_once(blobs):
    blobs.put_again("inspections/00ff/wall/-3.jpg", b"tile")
    blobs.sync(["inspections/00ff/wall/-3.jpg", "inspections/00ff/wall/4.jpg"])
    assert blobs.get("inspections/00ff/wall/-3.jpg") == b"tile"


def test_a_missing_blob_is_said_to_be_missing(blobs):
    for ask in (blobs.get, blobs.about, lambda key: blobs.read_range(key, 0, 1)):
        with pytest.raises(BlobNotFound, match=FILM):
            ask(FILM)
    with pytest.raises(BlobNotFound), blobs.local(FILM):
        pass
    assert not blobs.exists(FILM)
    blobs.delete(FILM)
    blobs.delete_all("inspections/00ff")
    assert keys_of(blobs, "inspections") == []


def test_a_large_file_is_stored_and_read_in_parts(blobs, tmp_path):
    content = os.urandom(LARGE)
    source = file_of(tmp_path / "data" / "uploads" / "film.bin", content)
    blobs.put_file(FILM, source)
    blobs.adopt("inspections/00ff/other.mp4", source)
    source.unlink()
    for key in (FILM, "inspections/00ff/other.mp4"):
        assert blobs.about(key).size == LARGE
        assert blobs.get(key) == content
    assert b"".join(blocks(blobs, FILM, 5, LARGE - 12)) == content[5:-7]
    with blobs.local(FILM) as path:
        assert path.read_bytes() == content
        assert path.suffix == ".mp4"
        assert any(path.is_relative_to(folder) for folder in blobs.media)


def test_a_range_of_a_blob(blobs):
    blobs.put(FILM, b"0123456789")
    for first, length in ((0, 1), (3, 4), (9, 1), (8, 50), (0, 10)):
        assert blobs.read_range(FILM, first, length) == b"0123456789"[first : first + length]


def test_blobs_are_listed_in_order_and_deleted_together(blobs, is_long):
    """In the long run they are more than an S3 server lists at once."""
    count = 1020 if is_long else 20
    names = sorted(f"inspections/00ff/wall/{index}.jpg" for index in range(count))
    others = ["inspections/00f/video.mp4", "inspections/00ff.mp4", "inspections/00fff/track.csv"]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda key: blobs.put_again(key, key.encode()), [*names, *others]))
    assert keys_of(blobs, "inspections/00ff") == names
    assert keys_of(blobs, "inspections") == sorted([*names, *others])
    assert sum(blob.size for blob in blobs.listed("inspections/00ff")) == len("".join(names))
    blobs.delete("inspections/00ff/wall/7.jpg")
    assert not blobs.exists("inspections/00ff/wall/7.jpg")
    blobs.delete_all("inspections/00ff")
    assert keys_of(blobs, "inspections") == sorted(others)


NO_KEYS = ("../x", "/etc/passwd", "a/../../x", "a//b", "", ".", "a/.part", "a\\..\\b", "a\n", "ü")


def test_no_key_leads_out_of_the_store(blobs, tmp_path):
    source = file_of(tmp_path / "film.bin", b"x")
    for key, ask in product(NO_KEYS, (
        blobs.get,
        blobs.delete,
        blobs.delete_all,
        blobs.exists,
        lambda key: list(blobs.listed(key)),
        lambda key: blobs.put(key, b""),
        lambda key: blobs.put_file(key, source),
        lambda key: blobs.adopt(key, source),
        lambda key: blobs.local(key).__enter__(),
    )):  # fmt: skip
        with pytest.raises(ValueError, match="no key"):
            ask(key)
    assert source.exists()


def test_a_store_that_can_be_written_says_so(blobs, url, tmp_path):
    blobs.check()
    assert (str(tmp_path / "data") if url is None else "s3://films-") in blobs.name
    assert "endpoint" not in blobs.name


def test_a_folder_adopts_a_file_without_copying_it(tmp_path):
    source = file_of(tmp_path / "film.bin", b"film")
    blobs = blobs_at(None, tmp_path)
    blobs.put(FILM, b"before")
    assert blobs.adopt(FILM, source)
    with blobs.local(FILM) as path:
        assert path.samefile(source)
        assert not blobs.adopt(FILM, path)
        assert path.read_bytes() == b"film"


def test_a_folder_copies_where_a_file_has_one_name_only(tmp_path, monkeypatch):
    def refused(*_args):
        raise OSError(errno.EPERM, "no links here")

    monkeypatch.setattr("pathlib.Path.hardlink_to", refused)
    source = file_of(tmp_path / "film.bin", b"film")
    blobs = blobs_at(None, tmp_path)
    blobs.adopt(FILM, source)
    source.unlink()
    assert blobs.get(FILM) == b"film"


def test_a_deleted_blob_stays_readable_for_who_holds_it(blobs):
    blobs.put(FILM, b"film")
    with blobs.local(FILM) as path, path.open("rb") as file:
        blobs.delete(FILM)
        assert file.read() == b"film"
    with pytest.raises(BlobNotFound), blobs.local(FILM):
        pass


def test_a_replaced_blob_has_another_copy(blobs):
    blobs.put(FILM, b"before")
    with blobs.local(FILM):
        pass
    blobs.put(FILM, b"after!")
    with blobs.local(FILM) as path:
        assert path.read_bytes() == b"after!"


def test_a_full_disk_is_reported_as_one(tmp_path, monkeypatch):
    blobs = blobs_at(None, tmp_path)

    def full(*_args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.storage.folder.files.os.fsync", full)
    source = file_of(tmp_path / "film.bin", b"film")
    for write in (lambda: blobs.put(FILM, b"x"), lambda: blobs.put_file(FILM, source)):
        with pytest.raises(DiskFull):
            write()
    assert keys_of(blobs, "inspections") == []
    assert list((tmp_path / "inspections" / "00ff").iterdir()) == []


# ------------------------------------------------------------------------------ scratch copies


def copies(tmp_path):
    return {path.name for path in (tmp_path / "scratch").iterdir()}


def test_copies_stay_within_their_bound_and_none_in_use_is_deleted(object_store, tmp_path):
    blobs = blobs_at(object_store.new(), tmp_path, scratch_bytes=250)
    for name in "abcd":
        blobs.put(f"{name}.mp4", name.encode() * 100)
    with blobs.local("a.mp4") as a:
        with blobs.local("b.mp4") as b:
            pass
        with blobs.local("c.mp4") as c:
            assert copies(tmp_path) == {a.name, c.name}
            assert not b.exists()
            with blobs.local("d.mp4") as d:  # no room, and both others are in use
                assert copies(tmp_path) == {a.name, c.name, d.name}
        with blobs.local("b.mp4"):
            assert copies(tmp_path) == {a.name, b.name}
        assert a.read_bytes() == b"a" * 100


def test_a_copy_is_fetched_once_for_all_threads(object_store, line, tmp_path):
    blobs = blobs_at(object_store.new(line.port), tmp_path)
    blobs.put(FILM, bytes(LARGE))
    together = threading.Barrier(6, timeout=60)

    def inode(_):
        together.wait()
        with blobs.local(FILM) as path:
            together.wait()
            return path.stat().st_ino

    with ThreadPoolExecutor(6) as pool:
        assert len(set(pool.map(inode, range(6)))) == 1
    assert line.received < 1.5 * LARGE


HOLDER = """
import sys
from pathlib import Path
from app.storage.blobs.stores import blobs_at
with blobs_at(sys.argv[1], Path(sys.argv[2]), scratch_bytes=100).local("a.mp4") as path:
    print(path.name, flush=True)
    sys.stdin.read()
"""


def test_a_copy_that_another_process_uses_stays_until_that_ends(object_store, tmp_path):
    url = object_store.new()
    blobs = blobs_at(url, tmp_path, scratch_bytes=100)
    blobs.put("a.mp4", b"a" * 100)
    blobs.put("b.mp4", b"b" * 100)
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, url, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        held = holder.stdout.readline().strip()
        with blobs.local("b.mp4") as path:
            assert copies(tmp_path) == {held, path.name}
        holder.kill()
        holder.wait()
    blobs.put("c.mp4", b"c" * 100)
    with blobs.local("c.mp4") as path:
        assert copies(tmp_path) == {path.name}


def test_a_copy_that_was_cut_short_is_fetched_again(object_store, tmp_path):
    blobs = blobs_at(object_store.new(), tmp_path)
    blobs.put(FILM, b"film")
    with blobs.local(FILM) as path:
        pass
    path.write_bytes(b"fi")
    path.with_name(f".{path.name}.part").write_bytes(b"left by a process that was killed")
    with blobs.local(FILM) as path:
        assert path.read_bytes() == b"film"
    assert copies(tmp_path) == {path.name}


# ------------------------------------------------------------------------------ a store that fails


def test_a_store_that_is_away_is_named_and_works_again(object_store, line, tmp_path):
    blobs = blobs_at(object_store.new(line.port), tmp_path)
    blobs.put(FILM, b"film")
    source = file_of(tmp_path / "film.bin", b"another")
    line.cut()
    for ask in (
        lambda: blobs.adopt(FILM, source),
        lambda: blobs.get(FILM),
        lambda: blobs.delete_all("inspections"),
        lambda: list(blobs.listed("inspections")),
        lambda: blobs.local(FILM).__enter__(),
        blobs.check,
    ):
        with pytest.raises(StoreUnavailable, match=r"s3://films-.* does not answer") as caught:
            ask()
        assert "secret" not in str(caught.value)
    assert source.exists()
    line.mend()
    assert blobs.get(FILM) == b"film"
    blobs.adopt(FILM, source)
    assert blobs.get(FILM) == b"another"
    blobs.adopt(FILM, source)
    assert blobs.get(FILM) == b"another"


def test_a_missing_bucket_is_named(object_store, tmp_path):
    with pytest.raises(StoreUnavailable, match="The bucket of s3://nowhere/archive does not exist"):
        blobs_at(object_store.url("nowhere"), tmp_path).check()


@pytest.mark.parametrize(
    "url",
    [
        "http://bucket", "s3:///prefix", "s3://key:secret@bucket/x", "s3://b?secret_access_key=secret",
        "s3://b?endpoint=http://key:secret@host", "bucket", "s3://b/../c",
    ],
)  # fmt: skip
def test_a_wrong_url_is_refused_without_its_secrets(tmp_path, url):
    with pytest.raises(InvalidSettings, match="CHAINAGE_STORE must read s3://") as caught:
        blobs_at(url, tmp_path)
    assert "secret" not in str(caught.value)
