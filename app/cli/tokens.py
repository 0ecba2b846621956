"""The commands of `chainage token`."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.table import Table

from app.cli.console import (
    Data,
    data_folder,
    err,
    out,
)

if TYPE_CHECKING:
    from app.storage.folder.tokens import TokenFile  # slow to import, and few commands need it

commands = typer.Typer(
    help="Named access tokens of a data folder, also while a server uses it.", no_args_is_help=True
)


@commands.command("create")
def create_token(
    name: Annotated[str, typer.Argument(help="User of the token, as shown in the history.")],
    role: Annotated[
        Literal["viewer", "operator", "admin"],
        typer.Option(
            help="viewer: looks and exports.  operator: also inspects, tags and corrects.  "
            "admin: also deletes inspections and changes code packs."
        ),
    ],
    project: Annotated[
        list[str] | None,
        typer.Option(help="Limit it to this project; may be given several times."),
    ] = None,
    data: Data = None,
) -> None:
    """Make a token and print it once."""
    from app.access.access import create_token as create
    from app.access.access import fault_of_name
    from app.storage.folder.tokens import Role

    if fault := fault_of_name(name):
        raise typer.BadParameter(fault, param_hint="NAME")
    file = _token_file(data)
    projects = frozenset(name.strip() for name in project) if project else None
    if projects is not None and "" in projects:
        raise typer.BadParameter("names no project", param_hint="--project")
    secret = create(file, name, Role(role), projects)
    err.print(f"Token {name} ({role}) for {file.folder}; it is not shown again:")
    out.print(secret)


@commands.command("list")
def list_tokens(data: Data = None) -> None:
    """List the named tokens, including revoked ones."""
    table = Table("name", "role", "projects", "created", "revoked", box=None)
    for token in _token_file(data).all():
        projects = "all" if token.projects is None else ", ".join(sorted(token.projects))
        days = _day(token.created_at), _day(token.revoked_at)
        table.add_row(token.name, token.role, projects, *days)
    out.print(table)


@commands.command("revoke")
def revoke_token(
    name: Annotated[str, typer.Argument(help="Name of the token.")], data: Data = None
) -> None:
    """Revoke a token and end all of its sessions at once."""
    file = _token_file(data)
    file.revoke(name)
    err.print(f"Token {name} for {file.folder} is revoked.")


def _token_file(data: Path | None) -> TokenFile:
    from app.storage.folder.tokens import TokenFile

    return TokenFile(data_folder(data))


def _day(instant: datetime | None) -> str:
    return "-" if instant is None else f"{instant.astimezone():%Y-%m-%d %H:%M}"
