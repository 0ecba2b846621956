"""Numbered clips that are tracked once for all files of browser tests."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from clips import numbered_clip, rig_for_clip
from steps import Server
from surveys import Survey, tracked_once

FRAMES = 40
SEVERAL, SHORT_FRAMES = 3, 20
"""Inspections of one survey with several, and frames of each of their films."""


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


def several_clips(temporary: pytest.TempPathFactory) -> Survey:
    """`SEVERAL` inspections, each named "clip", of one short film, without any tag."""

    def track(data: Path) -> str:
        folder = temporary.mktemp("clips")
        clip = numbered_clip(folder / "clip.mp4", "libx264", frames=SHORT_FRAMES)
        rig = rig_for_clip(folder / "rig.json")
        with Server(data) as server:
            first, *_ = [server.track(clip, rig) for _ in range(SEVERAL)]
        return first

    return tracked_once(temporary, "several-clips", track)


def ids_of(server: Server) -> list[str]:
    """The ids of all its inspections."""
    listed = json.load(server.ask("GET", "/api/inspections"))["inspections"]
    return [each["id"] for each in listed]
