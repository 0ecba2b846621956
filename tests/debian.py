"""Installs packages of Debian for the tests, where that is possible."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from locks import alone

T = TypeVar("T")


def found_or_installed(find: Callable[[], T | None], *packages: str) -> T | None:
    """Return what `find` finds, after the packages were installed if it finds nothing.

    Several test processes miss the same at the same time: one installs it, and the others wait.
    """
    if os.geteuid() != 0 or shutil.which("apt-get") is None:
        return find()
    with alone(Path(tempfile.gettempdir(), "chainage-tests-apt.lock")):
        if find() is None:
            for words in (["update"], ["install", "--yes", *packages]):
                subprocess.run(["apt-get", "--quiet", *words], check=False)
        return find()
