"""The command `chainage archive export`: everything of all inspections, for analysis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from app.cli.console import (
    Data,
    advance,
    err,
    out,
    progress_bar,
    require_folder,
    settings_of,
    write_whole,
)

if TYPE_CHECKING:
    from app.data_folder import Records

_NAMED = 5
"""Inspections without a track that are named."""


def export(
    file: Annotated[
        Path, typer.Argument(metavar="OUT", help="ZIP archive to write; it is replaced whole.")
    ],
    format: Annotated[  # noqa: A002
        Literal["parquet", "json"],
        typer.Option(help="Format of the tables; parquet needs pip install 'chainage[archive]'."),
    ] = "json",
    tracks: Annotated[
        bool, typer.Option("--tracks", help="Also a row for each frame of each film.")
    ] = False,
    data: Data = None,
) -> None:
    """Write tables of all inspections, their defects and the quality of their films into a ZIP.

    A server may be running.
    """
    from app.data_folder import reading
    from app.errors import ExportNotAvailable, UnusableDatabase

    require_folder(file, "OUT")
    if file.is_dir():
        raise typer.BadParameter(f"{file} is a folder", param_hint="OUT")
    settings = settings_of(data)
    try:
        with reading(settings) as records:
            blocks = records.archive_export.blocks(format, with_tracks=tracks)
            if settings.database_url is None:  # else a server indexes, and it is only read here
                with progress_bar() as progress:
                    task = progress.add_task("Indexing", visible=False)
                    total = records.defect_index.pending()
                    for done, _ in enumerate(records.indexer.index_next(), 1):
                        advance(progress, task, done, total)
            pending = records.defect_index.pending()
            write_whole(file, blocks)
            lost = _without_track(records) if tracks else []
    except UnusableDatabase as error:
        raise typer.BadParameter(str(error), param_hint="--data") from error
    except ExportNotAvailable as error:
        raise typer.BadParameter(str(error), param_hint="--format") from error
    if pending:
        err.print(
            f"warning: {pending} inspections are not indexed in their present state, so they are "
            "missing or older in the tables",
            style="yellow",
        )
    if lost:
        named = ", ".join(lost[:_NAMED]) + (", …" if len(lost) > _NAMED else "")
        err.print(f"error: the store has no sound track of {named}; their rows are missing")
        raise typer.Exit(1)
    out.print(f"{file}: everything as {format}")


def _without_track(records: Records) -> list[str]:
    """Return the names of inspections that were tracked, and whose track is gone or damaged."""
    from app.storage.database.tables import ENDED

    return [
        one.row.name
        for one in records.inspection_store.summaries()
        if one.row.status in ENDED
        and one.row.frames_done
        and not records.tracks.is_readable(one.row.id)
    ]
