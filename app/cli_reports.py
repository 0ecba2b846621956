"""The commands about reports: `chainage export`."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from app.console import Data, err, out, require_folder

if TYPE_CHECKING:
    # A second to import, for few commands.
    from app.reports.report import Loss
    from app.storage.tables import Inspection


def export(
    inspection: Annotated[
        str, typer.Argument(help="Id of the inspection, the beginning of it, or its exact name.")
    ],
    format: Annotated[  # noqa: A002
        str,
        typer.Option(
            help="csv, json, xlsx, html, pdf, en13508, isybau, m150, ribx, geojson or zip, which "
            "holds them with photos and track, signed."
        ),
    ],
    file: Annotated[Path, typer.Option("--out", help="File to write; it is replaced whole.")],
    data: Data = None,
    lang: Annotated[
        Literal["en", "ms"], typer.Option(help="Language of the formats that people read.")
    ] = "en",
    units: Annotated[Literal["m", "ft"], typer.Option(help="Units of the same.")] = "m",
) -> None:
    """Write the report of an inspection, without a server or beside one.

    What the format cannot hold is told on standard error.
    """
    from app.errors import ExportNotAvailable, UnusableDatabase
    from app.reports.formats import FORMATS
    from app.reports.report import Company
    from app.services.reader import reading
    from app.settings import Settings

    if format not in FORMATS:
        raise typer.BadParameter(
            f"there is no {format!r}; there are {', '.join(FORMATS)}", param_hint="--format"
        )
    require_folder(file, "--out")
    if file.is_dir():
        raise typer.BadParameter(f"{file} is a folder", param_hint="--out")
    settings = Settings.load() if data is None else Settings.load(data=data)
    company = Company(settings.company_name, settings.company_logo)
    try:
        with reading(settings.data, company) as reader:
            row = _the_one(reader.named(inspection), inspection)
            written = reader.reports.export(row.id, format, language=lang, units=units).written
            _replace(file, written.blocks())
    except UnusableDatabase as error:
        raise typer.BadParameter(str(error), param_hint="--data") from error
    except ExportNotAvailable as error:
        raise typer.BadParameter(str(error), param_hint="--format") from error
    if row.status in ("queued", "running"):
        err.print(
            f"warning: {row.name} is {row.status}: its track is not on the disk before it has "
            "ended, so that distances are missing",
            style="yellow",
        )
    _tell(written.losses)
    out.print(f"{file}: {row.name} ({row.id})")


def _the_one(found: list[Inspection], wanted: str) -> Inspection:
    if not found:
        raise typer.BadParameter(
            f"no inspection has the id or the name {wanted!r}", param_hint="INSPECTION"
        )
    if len(found) > 1:
        listed = ", ".join(f"{row.id} ({row.name})" for row in found[:5])
        more = f" and {len(found) - 5} more" if len(found) > 5 else ""
        raise typer.BadParameter(
            f"{wanted!r} is not clear, it may be {listed}{more}; name the id",
            param_hint="INSPECTION",
        )
    return found[0]


def _tell(losses: Iterable[Loss]) -> None:
    for loss in losses:
        where = "" if loss.entry is None else f"observation {loss.entry.seq}: "
        err.print(f"not in this format: {where}{loss.detail}", style="yellow")


def _replace(file: Path, blocks: Iterable[bytes]) -> None:
    """Write the whole file or leave the old one."""
    part = file.with_name(f".{file.name}.{secrets.token_hex(4)}.part")
    try:
        with part.open("xb") as target:
            for block in blocks:
                target.write(block)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)
