"""Damage to files of every container and codec; tests/measure/fuzz_media.py does far more of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from hostile import CODINGS, KINDS, RIG, Edit, edited, write_seeds
from hypothesis import given
from hypothesis import strategies as st
from ready_tracker import ReadyTracker

EDITS = st.lists(
    st.builds(
        Edit,
        kind=st.sampled_from(sorted(KINDS)),
        at=st.floats(0, 1),
        value=st.integers(0, 2**16 - 1),
    ),
    min_size=1,
    max_size=4,
)
CLEAR = ("whole", "partial", "unreadable_video", "out_of_memory", "rig_video_mismatch")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("mutations")


@pytest.fixture(scope="module")
def seeds(folder: Path) -> dict[str, bytes]:
    return write_seeds(folder)


@pytest.fixture(scope="module")
def tracker() -> Iterator[ReadyTracker]:
    with ReadyTracker(RIG) as ready:
        yield ready


def test_a_whole_clip_of_every_coding_is_tracked_whole(
    tracker: ReadyTracker, folder: Path, seeds: dict[str, bytes], *, is_long: bool
) -> None:
    names = sorted(seeds)[:: 1 if is_long else 4]
    verdicts = {name: tracker.verdict(folder / name) for name in names}
    assert {name: (each.end, each.frames) for name, each in verdicts.items()} == dict.fromkeys(
        names, ("whole", 16)
    ), verdicts


@given(name=st.sampled_from(sorted(CODINGS)), other=st.sampled_from(sorted(CODINGS)), edits=EDITS)
def test_a_damaged_file_ends_clearly(
    tracker: ReadyTracker,
    folder: Path,
    seeds: dict[str, bytes],
    name: str,
    other: str,
    edits: list[Edit],
) -> None:
    path = folder / f"damaged{Path(name).suffix}"
    path.write_bytes(edited(seeds[name], edits, seeds[other]))
    verdict = tracker.verdict(path)
    assert verdict.end in CLEAR, verdict
    assert verdict.frames == 0 or verdict.end in ("whole", "partial"), verdict
    assert verdict.end == "whole" or verdict.said.endswith("."), verdict
