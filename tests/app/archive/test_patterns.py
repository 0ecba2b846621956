"""Patterns of paths: what they fit, what their fields hold, and that none takes long."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.archive.patterns import InvalidPattern, compiled


@pytest.mark.parametrize(
    ("pattern", "path", "fields"),
    [
        ("*.mp4", "a.MP4", {}),
        ("*.mp4", "x/a.mp4", None),
        ("**", "a.mp4", {}),
        ("**", "x/y/a.mp4", {}),
        ("**/*.mp4", "a.mp4", {}),
        ("**/*.mp4", "x/y/a.mp4", {}),
        ("x/**", "x/y/a.mp4", {}),
        ("x/**", "x", None),
        ("clip?.avi", "clip7.avi", {}),
        ("clip?.avi", "clip.avi", None),
        ("{project}/{asset}_{date}.mp4", "R 5/C_1_2026.mp4", {"project": "R 5", "asset": "C", "date": "1_2026"}),  # noqa: E501
        ("{project}/**/{asset}-*.*", "R/a/b/C-7-9.x.mp4", {"project": "R", "asset": "C"}),
        ("{asset}.mp4", ".mp4", None),
        ("a.c", "abc", None),
        ("**/b/**/{name}.ts", "b/b/x/n\n1.ts", {"name": "n\n1"}),
    ],
)  # fmt: skip
def test_a_pattern_fits(pattern: str, path: str, fields: dict[str, str] | None) -> None:
    assert compiled(pattern).match(path) == fields


@pytest.mark.parametrize(
    ("pattern", "reason"),
    [
        ("/a", "slash"), ("a//b", "slash"), ("a/", "slash"), ("{a}{b}", "between"),
        ("{a}*", "between"), ("a**", "whole name"), ("{a", "partner"), ("a}", "partner"),
        ("{A}", "lower-case"),
        ("{}", "lower-case"), ("{a}/{a}", "twice"),
    ],
)  # fmt: skip
def test_what_is_no_pattern_is_refused_with_the_reason(pattern: str, reason: str) -> None:
    with pytest.raises(InvalidPattern, match=reason):
        compiled(pattern)


NAMES = st.text("ab.", min_size=1, max_size=8)


def fits(pattern: str, text: str) -> bool:
    """Try everything that each wildcard may be."""
    if not pattern:
        return not text
    if pattern[0] == "*":
        return any(fits(pattern[1:], text[taken:]) for taken in range(len(text) + 1))
    return bool(text) and pattern[0] in ("?", text[0]) and fits(pattern[1:], text[1:])


@given(st.text("ab.*?", min_size=1, max_size=8).filter(lambda text: "**" not in text), NAMES)
def test_wildcards_fit_what_trying_everything_finds(pattern: str, name: str) -> None:
    assert (compiled(pattern).match(name) is not None) == fits(pattern, name)


FOLDERS = st.lists(st.sampled_from("ab"), min_size=1, max_size=5)


def folders_fit(pattern: list[str], path: list[str]) -> bool:
    if not pattern:
        return not path
    if pattern[0] == "**":
        least = 1 if len(pattern) == 1 else 0
        taken = range(least, len(path) + 1)
        return any(folders_fit(pattern[1:], path[number:]) for number in taken)
    return bool(path) and path[0] == pattern[0] and folders_fit(pattern[1:], path[1:])


@given(st.lists(st.sampled_from(["a", "b", "**"]), min_size=1, max_size=5), FOLDERS)
def test_folders_fit_what_trying_everything_finds(pattern: list[str], path: list[str]) -> None:
    found = compiled("/".join(pattern)).match("/".join(path))
    assert (found is not None) == folders_fit(pattern, path)


def test_no_pattern_makes_the_search_long() -> None:
    assert compiled("*a" * 100 + "b").match("a" * 4000) is None
    assert compiled("/".join(["**", "a"] * 50) + "/b").match("/".join("a" * 500)) is None
