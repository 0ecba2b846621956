"""The page about accuracy."""

from pathlib import Path

from app.simulation import SCENARIOS

PAGE = Path(__file__).parents[3] / "docs" / "accuracy.md"


def test_page_about_accuracy_says_what_every_scenario_is():
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in SCENARIOS if f"`{name}`" not in text] == []
