"""Files of the data folder are replaced whole, whoever else writes them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from app.storage.folder.files import replace_file


def test_a_file_may_be_replaced_by_several_at_once(tmp_path: Path) -> None:
    path, contents = tmp_path / "film.jpg", [bytes([n]) * 10_000 for n in range(16)]
    with ThreadPoolExecutor(len(contents)) as pool:
        for _ in range(20):
            list(pool.map(lambda content: replace_file(path, content), contents))
            assert path.read_bytes() in contents
    assert list(tmp_path.iterdir()) == [path]
