from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

from app.storage.folder.temporary import temporary_folder

USE = """
import sys
from pathlib import Path
from app.storage.folder.temporary import temporary_folder
with temporary_folder("pdf-", Path(sys.argv[1])) as folder:
    (folder / "photo.jpg").write_bytes(b"of a customer")
    print(folder, flush=True)
    sys.stdin.read()
"""


def test_what_a_killed_process_leaves_goes_and_what_another_uses_stays(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", USE, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None
        theirs = Path(other.stdout.readline().strip())
        with temporary_folder("pdf-", tmp_path) as ours:
            assert sorted(tmp_path.iterdir()) == sorted((ours, theirs))
        other.send_signal(signal.SIGKILL)
        other.wait()
        assert [*tmp_path.iterdir()] == [theirs]
        with temporary_folder("pdf-", tmp_path) as ours:
            assert [*tmp_path.iterdir()] == [ours]
    assert not any(tmp_path.iterdir())
