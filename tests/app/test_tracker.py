"""The name of the program that tracks."""

from __future__ import annotations

import ast
import runpy
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import app.tracker


def test_threads_that_ask_at_once_make_syntax_trees_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    parse, is_parsing, met = ast.parse, threading.Lock(), []

    def watched(text: str) -> ast.Module:
        if not is_parsing.acquire(blocking=False):
            met.append(text)
            return parse(text)
        try:
            time.sleep(0)  # lets the other threads go on
            return parse(text)
        finally:
            is_parsing.release()

    fresh = runpy.run_path(str(app.tracker.__file__))["tracker"]  # it knows no name yet
    with monkeypatch.context() as patched, ThreadPoolExecutor(4) as pool:
        patched.setattr(ast, "parse", watched)
        assert {*pool.map(lambda _: fresh(), range(4))} == {app.tracker.tracker()}
    assert met == []
