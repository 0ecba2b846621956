"""Shared parts of the commands: consoles, the data folder, checks of arguments."""

from __future__ import annotations

import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import parse_qsl, urlencode, urlsplit, urlunsplit

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from app.storage.folder.files import Places

if TYPE_CHECKING:
    from app.settings import Settings  # slow to import, and few commands need it

# No markup: file names and values from files contain brackets.
out = Console(markup=False, highlight=False, soft_wrap=True)
err = Console(markup=False, highlight=False, soft_wrap=True, stderr=True)

Data = Annotated[
    Path | None, typer.Option(help="Data folder.  [default: chainage-data or CHAINAGE_DATA]")
]


def settings_of(data: Path | None) -> Settings:
    """Return the settings, with the named data folder if there is one."""
    from app.settings import Settings

    return Settings.load() if data is None else Settings.load(data=data)


def print_address(console: Console, url: str, data: Path) -> None:
    """Print where the server is reached, with the token on a terminal only: what is printed
    elsewhere is kept, as in a journal, and read by more people than the token's file.

    Args:
        console: Where to print.
        url: Address of the log-in, with the token unless its operator has set one.
        data: Data folder of the server.
    """
    parts = urlsplit(url)
    others = [(name, value) for name, value in parse_qsl(parts.query) if name != "token"]
    bare = urlunsplit(parts._replace(query=urlencode(others, safe="/")))
    if console.file.isatty() or bare == url:
        console.print(f"Open {url}")
    else:
        console.print(f"Open {bare} and log in with the token in {Places(data).token}")


def data_folder(data: Path | None) -> Path:
    """Return the named data folder, else that of the settings."""
    return settings_of(data).data


def require_folder(file: Path, option: str) -> None:
    """Check that the folder of an output file exists, before the work starts."""
    if not file.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {file.parent}", param_hint=option)


def write_whole(file: Path, blocks: Iterable[bytes]) -> None:
    """Write the whole file or keep the old one."""
    part = file.with_name(f".{file.name}.{secrets.token_hex(4)}.part")
    try:
        with part.open("xb") as target:
            for block in blocks:
                target.write(block)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def require_picture(file: Path, option: str) -> None:
    """Check folder and picture format of an output file, before the work starts."""
    require_folder(file, option)
    if file.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise typer.BadParameter(f"{file.name} is not .png, .pdf or .svg", param_hint=option)


def print_rows(rows: Iterable[tuple[str, str]], title: str | None = None) -> None:
    """Print names and values in two columns."""
    table = Table(show_header=False, box=None, title=title, title_justify="left")
    for name, value in rows:
        table.add_row(name, value)
    out.print(table)


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Show a progress bar on standard error while the block runs."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=err) as progress:
        yield progress


def advance(progress: Progress, task: TaskID, done: int, total: int | None) -> None:
    """Update a task with the amount done."""
    progress.update(task, completed=done, total=total, visible=True)
