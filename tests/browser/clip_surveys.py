"""Numbered clips that are tracked once for all files of browser tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from clips import numbered_clip
from steps import Server
from surveys import Survey, tracked_once

FRAMES = 40


def clip_survey(
    temporary: pytest.TempPathFactory, name: str, write_rig: Callable[[Path], Path]
) -> Survey:
    """A clip of `FRAMES` frames, tracked with a rig, without any tag."""

    def track(data: Path) -> str:
        folder = temporary.mktemp("clip")
        clip = numbered_clip(folder / "clip.mp4", "libx264", frames=FRAMES)
        with Server(data) as server:
            return server.track(clip, write_rig(folder / "rig.json"))

    return tracked_once(temporary, f"{name}-clip", track)
