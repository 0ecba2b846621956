"""The 3D view, for as long as a test looks at it: software takes a core to draw it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Page


@contextmanager
def drawn_in_3d(page: Page) -> Iterator[Page]:
    """Open the address of a page in another one, which draws in 3D even if the first cannot."""
    other = page.context.new_page()
    faults: list[str] = []
    other.on("pageerror", lambda error: faults.append(str(error)))
    other.goto(page.url)
    yield other
    other.close()
    assert not faults, faults
