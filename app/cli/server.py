"""The commands of the server: demo, serve, backup, restore."""

from __future__ import annotations

import gc
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import (
    Progress,
    TaskID,
)

from app.cli.console import (
    Data,
    advance,
    err,
    out,
    print_address,
    progress_bar,
    require_folder,
    settings_of,
)
from app.cli.reports import own_fingerprint
from vo_core import ChainageError

if TYPE_CHECKING:
    from app.storage.database.backup import Summary  # slow to import, and few commands need it

Port = Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0: any free port.")]
Host = Annotated[str, typer.Option(help="Address to listen on.")]

_MIB = 2**20


def demo(host: Host = "127.0.0.1", port: Port = 8000) -> None:
    """Serve the dashboard with a sample culvert inspection that starts when it is opened."""
    from app.cli.demo import run_demo

    with progress_bar() as progress:
        # Shown with the first frame only: the port or a setting may be refused before.
        task = progress.add_task("rendering a sample culvert", total=None, visible=False)
        run_demo(
            host,
            port,
            on_progress=partial(advance, progress, task),
            on_ready=partial(_announce, progress),
        )


def serve(
    host: Host = "127.0.0.1",
    port: Port = 8000,
    data: Data = None,
    tls_cert: Annotated[
        Path | None, typer.Option(help="Certificate (PEM): serve over https.")
    ] = None,
    tls_key: Annotated[Path | None, typer.Option(help="Private key of the certificate.")] = None,
    insecure_lan: Annotated[
        bool,
        typer.Option(
            "--insecure-lan",
            help="Let other machines connect without https; every page then warns.",
        ),
    ] = False,
) -> None:
    """Serve the dashboard."""
    gc.disable()  # what is loaded now stays: `main.run` freezes it and collects from then on
    from app import main as server
    from app.settings import Settings

    options = {
        "data": data,
        "tls_cert": tls_cert,
        "tls_key": tls_key,
        "insecure_lan": insecure_lan or None,
    }
    given = {name: value for name, value in options.items() if value is not None}
    settings = Settings.load(**given)

    def announce(url: str, _: object) -> None:
        print_address(out, url, settings.data)
        try:
            out.print(f"Evidence bundles are signed with the key {own_fingerprint(settings.data)}")
        except (ChainageError, OSError) as error:  # everything else works without it
            err.print(f"warning: {error}", style="yellow")

    server.serve(settings, host, port, announce)


def backup(
    file: Annotated[Path, typer.Argument(help="Archive to write (ZIP); it is replaced whole.")],
    data: Data = None,
) -> None:
    """Write a data folder and its database into an archive; a server may go on using it.

    The server's own token and uploads without an inspection are left out.
    """
    from app.storage.database import backup as archives

    require_folder(file, "FILE")
    settings = settings_of(data)
    with progress_bar() as progress:
        task = progress.add_task("backing up, MiB", total=None)
        on_progress = partial(_advance_mib, progress, task)
        done = archives.back_up(
            settings.data, file, on_progress, settings.database_url, settings.store
        )
    out.print(f"{file}: {_summarised(done)}")
    for name in done.missing:
        err.print(f"warning: {name} is missing in {settings.data}", style="yellow")


def restore(
    file: Annotated[Path, typer.Argument(help="Archive that `chainage backup` wrote.")],
    data: Data = None,
) -> None:
    """Restore a data folder and its database from an archive, after checking every file in it."""
    from app.storage.database import backup as archives

    settings = settings_of(data)
    require_folder(settings.data, "--data")
    with progress_bar() as progress:
        task = progress.add_task("restoring, MiB", total=None)
        on_progress = partial(_advance_mib, progress, task)
        done = archives.restore(
            file, settings.data, on_progress, settings.database_url, settings.store
        )
    out.print(f"{settings.data}: {_summarised(done)}")


def _advance_mib(progress: Progress, task: TaskID, done: int, total: int) -> None:
    advance(progress, task, round(done / _MIB), round(total / _MIB))


def _summarised(summary: Summary) -> str:
    return (
        f"{summary.inspections} inspections, {summary.observations} observations, "
        f"{summary.files} files, {summary.size_bytes / _MIB:.1f} MiB"
    )


def _announce(progress: Progress, url: str, data: Path) -> None:
    progress.stop()
    print_address(out, url, data)
    out.print("Stop with Ctrl+C.")
