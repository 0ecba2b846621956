"""The commands about reports: `chainage export` and `chainage verify`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.table import Column, Table

from app.cli.console import Data, err, out, require_folder, settings_of, write_whole

_BLOCK = 2**20

if TYPE_CHECKING:
    # slow to import, and few commands need it
    from app.data_folder import Records
    from app.reports.content.translator import Translator
    from app.reports.report import Extras, Loss
    from app.storage.database.tables import Inspection


def export(
    file: Annotated[Path, typer.Option("--out", help="File to write; it is replaced whole.")],
    format: Annotated[  # noqa: A002
        str,
        typer.Option(
            help="pdf, html, emergency, csv, xlsx, json, en13508, en13508xml, ribx, isybau, "
            "isybau2024, m150, geojson; zip, the evidence bundle: reports, tables, photos and "
            "tracks, signed; delivery, the exchange file with what it cites, report, page, "
            "checksums, signature; or archive, from which another server makes the same inspection."
        ),
    ],
    inspections: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[INSPECTION]...",
            help="Id of the inspection, its beginning, or the exact name; several make one PDF, "
            "one delivery, or a ZIP with a folder for each.",
        ),
    ] = None,
    project: Annotated[
        str | None, typer.Option(help="All inspections of this project, likewise.")
    ] = None,
    data: Data = None,
    lang: Annotated[
        str, typer.Option(help="Language of the formats that people read: en, ms ...")
    ] = "en",
    units: Annotated[
        Literal["m", "ft"], typer.Option(help="Units of the formats that people read.")
    ] = "m",
    exchange: Annotated[
        str, typer.Option(help="Exchange format of a delivery, such as en13508 or ribx.")
    ] = "en13508",
    film: Annotated[
        bool, typer.Option("--film", help="Put the film into the delivery or the archive.")
    ] = False,
    csv: Annotated[
        Literal["standard", "german"],
        typer.Option(
            help="german: a CSV with semicolons and decimal commas, as Excel there opens."
        ),
    ] = "standard",
    photos: Annotated[
        Literal["embedded"] | None,
        typer.Option(help="embedded: photos and voice notes are in the JSON report, too."),
    ] = None,
) -> None:
    """Write the report of an inspection, or of several, with or without a running server.

    What the format cannot hold is reported on standard error.
    """
    from app.data_folder import reading
    from app.errors import ExportNotAvailable, UnusableDatabase
    from app.reports.content.translator import Translator
    from app.reports.content.words import LANGUAGES
    from app.reports.formats import EXCHANGE, FORMATS
    from app.reports.report import Extras

    for value, known, hint in (
        (format, FORMATS, "--format"),
        (lang, LANGUAGES, "--lang"),
        (exchange, EXCHANGE, "--exchange"),
    ):
        if value not in known:
            there_are = ", ".join(known)
            raise typer.BadParameter(
                f"there is no {value!r}; there are {there_are}", param_hint=hint
            )
    require_folder(file, "--out")
    if file.is_dir():
        raise typer.BadParameter(f"{file} is a folder", param_hint="--out")
    wanted = inspections or []
    if not wanted and project is None:
        raise typer.BadParameter("name an inspection, or --project", param_hint="INSPECTION")
    is_several = len(wanted) > 1 or project is not None
    settings = settings_of(data)
    extras = Extras(exchange=exchange, film=film, photos=photos == "embedded", csv_style=csv)
    try:
        with reading(settings) as reader:
            rows = [_the_one(reader.named(name), name) for name in wanted]
            if is_several:
                rows += _of_project(reader, project)
                _write_several(reader, rows, file, format, Translator(lang, units), extras)
                return
            (row,) = rows
            written = reader.reports.export(
                row.id, format, language=lang, units=units, extras=extras
            ).written
            write_whole(file, written.blocks())
    except UnusableDatabase as error:
        raise typer.BadParameter(str(error), param_hint="--data") from error
    except ExportNotAvailable as error:
        raise typer.BadParameter(str(error), param_hint="--format") from error
    if row.status in ("queued", "running"):
        err.print(
            f"warning: {row.name} is {row.status}: its track is written to the disk when it "
            "ends, so distances are missing",
            style="yellow",
        )
    _print_losses(written.losses, Translator(lang, units))
    out.print(f"{file}: {row.name} ({row.id})")


def _of_project(reader: Records, project: str | None) -> list[Inspection]:
    from app.survey.fields.header import project_of

    if project is None:
        return []
    rows = [summary.row for summary in reader.inspection_store.summaries()]
    found = [row for row in rows if project_of(row.header) == project]
    if not found:
        raise typer.BadParameter(
            f"no inspection is of the project {project!r}", param_hint="--project"
        )
    return sorted(found, key=lambda row: (row.name, row.id))


def _write_several(
    reader: Records,
    rows: list[Inspection],
    file: Path,
    kind: str,
    t: Translator,
    extras: Extras,
) -> None:
    """Write one PDF over several inspections, each once, or a ZIP with this format of each."""
    from app.reports.bulk_archive import Sources, Wanted, Watcher, write

    is_document = kind == "pdf"
    wanted = Wanted(
        tuple(dict.fromkeys(row.id for row in rows)),
        () if is_document else (kind,),
        t,
        extras,
        document=is_document,
    )
    watcher = Watcher()
    with tempfile.TemporaryFile(dir=file.parent) as part:
        sources = Sources(reader.inspection_store, reader.reports, file.parent, lambda _bytes: None)
        write(wanted, sources, part, watcher)
        part.seek(0)
        write_whole(file, iter(partial(part.read, _BLOCK), b""))
    for one in watcher.not_made:
        err.print(f"not made: {one.name or one.inspection_id}: {one.detail}", style="yellow")
    made = set(wanted.inspections) - {one.inspection_id for one in watcher.not_made}
    out.print(f"{file}: {len(made)} inspections")


def verify(
    file: Annotated[Path, typer.Argument(help="Evidence bundle (ZIP).")],
    key: Annotated[
        str | None,
        typer.Option(
            metavar="FINGERPRINT|FILE",
            help="Key that must have signed it: the fingerprint that its server prints, or a file "
            "with the key (PEM).",
        ),
    ] = None,
    video: Annotated[
        Path | None, typer.Option(help="The film, to check that it is the inspected one.")
    ] = None,
) -> None:
    """Check an evidence bundle: every file, the signature, and the film.

    Exit code 0: everything is correct; 1: something is wrong; 2: the file is not a bundle that can
    be checked.
    """
    from app.errors import UnusableBundle
    from app.reports.bundle import verify as checking

    for path, hint in ((file, "FILE"), (video, "--video")):
        if path is not None and not path.is_file():
            raise typer.BadParameter(f"there is no file {path}", param_hint=hint)
    wanted = None if key is None else _fingerprint(key)
    try:
        verdict = checking.verify(file, key=wanted, video=video)
    except UnusableBundle as error:
        raise typer.BadParameter(str(error), param_hint="FILE") from error
    table = Table(
        "",
        Column("what", overflow="fold"),  # a shortened fingerprint cannot be compared
        Column("found", overflow="fold"),
        box=None,
    )
    words = {True: "right", False: "WRONG", None: "open"}
    for finding in verdict.findings:
        table.add_row(words[finding.is_right], finding.what, finding.detail)
    out.print(table)
    manifest = verdict.manifest
    out.print(f"key {manifest.fingerprint}")
    out.print(
        f"{manifest.name}: report {manifest.report_id}, revision {manifest.revision}, made "
        f"{manifest.made_at} by {manifest.program}"
    )
    wrong = sum(finding.is_right is False for finding in verdict.findings)
    if wrong:
        err.print(f"{file}: {wrong} of {len(verdict.findings)} checks failed", style="red")
        raise typer.Exit(1)


def own_fingerprint(data: Path) -> str:
    """Return the fingerprint of a data folder's signing key, which is made if missing."""
    from app.reports.bundle.signing import fingerprint
    from app.storage.folder.signing_key import SigningKey

    return fingerprint(SigningKey(data).public_key)


def _fingerprint(key: str) -> str:
    from app.reports.bundle.signing import fingerprint, public_key_of, read_fingerprint

    found = read_fingerprint(key)
    if found is not None:
        return found
    path = Path(key)
    if not path.is_file():
        raise typer.BadParameter(
            f"{key!r} is neither a fingerprint (SHA256: and 64 digits) nor a file",
            param_hint="--key",
        )
    public_key = public_key_of(path.read_bytes())
    if public_key is None:
        raise typer.BadParameter(f"{path} holds no Ed25519 key in PEM", param_hint="--key")
    return fingerprint(public_key)


def _the_one(found: list[Inspection], wanted: str) -> Inspection:
    if not found:
        raise typer.BadParameter(
            f"no inspection has the id or the name {wanted!r}", param_hint="INSPECTION"
        )
    if len(found) > 1:
        listed = ", ".join(f"{row.id} ({row.name})" for row in found[:5])
        more = f" and {len(found) - 5} more" if len(found) > 5 else ""
        raise typer.BadParameter(
            f"{wanted!r} is ambiguous, it may be {listed}{more}; give the id",
            param_hint="INSPECTION",
        )
    return found[0]


def _print_losses(losses: Iterable[Loss], t: Translator) -> None:
    for loss in losses:
        where = "" if loss.entry is None else f"observation {loss.entry.number}: "
        err.print(f"not in this format: {where}{t.loss(loss)}", style="yellow")
