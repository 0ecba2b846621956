"""What the commands share: where they print, the data folder, checks of their words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

# No markup: names of files and values out of them hold brackets.
out = Console(markup=False, highlight=False, soft_wrap=True)
err = Console(markup=False, highlight=False, soft_wrap=True, stderr=True)

Data = Annotated[
    Path | None, typer.Option(help="Data folder.  [default: chainage-data or CHAINAGE_DATA]")
]


def data_folder(data: Path | None) -> Path:
    """The one that is named, else that of the settings."""
    from app.settings import Settings

    return (Settings.load() if data is None else Settings.load(data=data)).data


def require_folder(file: Path, option: str) -> None:
    """Known now, not after an hour of work."""
    if not file.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {file.parent}", param_hint=option)
