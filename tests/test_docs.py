"""What an operator or a program meets is written where they look."""

from pathlib import Path

import pytest

from app.errors import STATUS
from app.settings import Settings

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize("name", Settings.model_fields)
def test_each_setting_is_in_the_readme(name):
    assert f"| `CHAINAGE_{name.upper()}` |" in (ROOT / "README.md").read_text("utf-8")


@pytest.mark.parametrize("code", [code for _, code in STATUS.values()])
def test_each_error_code_is_in_the_architecture(code):
    assert f"`{code}`" in (ROOT / "ARCHITECTURE.md").read_text("utf-8")
