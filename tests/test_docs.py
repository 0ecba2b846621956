"""What an operator or a program meets is written where they look."""

from pathlib import Path

import pytest

from app.errors import code_of
from app.settings import Settings
from app.web.answers import STATUS

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize("name", Settings.model_fields)
def test_each_setting_is_in_the_readme(name):
    assert f"| `CHAINAGE_{name.upper()}` |" in (ROOT / "README.md").read_text("utf-8")


@pytest.mark.parametrize("code", [code_of(kind) for kind in STATUS])
def test_each_error_code_is_in_the_architecture(code):
    assert f"`{code}`" in (ROOT / "ARCHITECTURE.md").read_text("utf-8")
