"""The page about accuracy."""

from pathlib import Path

from app.lab.simulation import SCENARIOS

PAGE = Path(__file__).parents[4] / "docs" / "accuracy.md"


def test_page_about_accuracy_says_what_every_scenario_is():
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in SCENARIOS if f"`{name}`" not in text] == []
