"""The file of the named tokens: whole at any time, whoever changes it."""

import stat
import threading
from pathlib import Path

import pytest

from app.errors import TokenNameTaken, TokenNotFound, UnreadableTokens
from app.storage.folder.tokens import Role, TokenFile


def test_changes_of_several_processes_are_all_kept_and_seen_at_once(tmp_path: Path) -> None:
    reader = TokenFile(tmp_path)
    assert reader.all() == ()

    def add(writer: int) -> None:
        tokens = TokenFile(tmp_path)  # locked as by another process
        for n in range(10):
            tokens.add(f"{writer}-{n}", Role.VIEWER, f"{writer}-{n}")

    threads = [threading.Thread(target=add, args=(writer,)) for writer in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({token.name for token in reader.all()}) == 40
    TokenFile(tmp_path).revoke("2-3")
    assert reader.valid("2-3") is None
    assert reader.valid("2-4") is not None
    assert stat.S_IMODE((tmp_path / "tokens.json").stat().st_mode) == 0o600


def test_a_name_has_one_valid_token(tmp_path: Path) -> None:
    tokens = TokenFile(tmp_path / "new" / "folder")
    with pytest.raises(TokenNotFound, match="crew"):
        tokens.revoke("crew")
    tokens.add("crew", Role.VIEWER, "first")
    with pytest.raises(TokenNameTaken, match="crew"):
        tokens.add("crew", Role.ADMIN, "second")
    tokens.revoke("crew")
    with pytest.raises(TokenNotFound):
        tokens.revoke("crew")
    tokens.add("crew", Role.ADMIN, "third")
    assert [tokens.valid(digest) is not None for digest in ("first", "third")] == [False, True]


def test_a_damaged_file_lets_nobody_in_and_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "tokens.json"
    tokens = TokenFile(tmp_path)
    tokens.add("crew", Role.VIEWER, "x")
    path.write_bytes(path.read_bytes()[:-20])
    damaged = path.read_bytes()
    with pytest.raises(UnreadableTokens, match=r"tokens\.json"):
        tokens.valid("x")
    with pytest.raises(UnreadableTokens):
        tokens.add("other", Role.VIEWER, "y")
    assert path.read_bytes() == damaged
