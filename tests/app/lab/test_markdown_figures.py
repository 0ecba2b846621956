"""Figures replace those of the last run, and nothing else."""

import pytest

from app.lab.markdown_figures import replace_figures

TEXT = "before\n<!-- bench:begin -->\nold\n<!-- bench:end -->\nafter <!-- other:begin -->\n"


def test_figures_stand_between_their_markers():
    replaced = replace_figures(TEXT, "bench", "| new | \\1 |\n")
    assert replaced == TEXT.replace("old", "| new | \\1 |")


def test_replacing_by_the_same_figures_changes_nothing():
    assert replace_figures(TEXT, "bench", "old") == TEXT


@pytest.mark.parametrize(
    "text",
    [
        "",
        "<!-- bench:begin -->",
        "<!-- bench:end --> <!-- bench:begin -->",
        "<!-- bench-field:begin --> <!-- bench-field:end -->",
        TEXT + TEXT,
    ],
)
def test_text_without_exactly_two_markers_is_refused(text):
    with pytest.raises(ValueError, match=r"needs <!-- bench:begin -->"):
        replace_figures(text, "bench", "new")
