"""What the tests of the commands share."""

import sys
from dataclasses import dataclass

import pytest

from app.cli.main import main


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


@pytest.fixture
def chainage(capsys, monkeypatch):
    """Run the command in this process."""

    def run(*words) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["chainage", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        return Outcome(end.value.code, *capsys.readouterr())

    return run
