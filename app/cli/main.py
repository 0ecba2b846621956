"""The command line: each command checks its arguments, calls one function and shows the result.

Exit codes: 0 done, 1 failed with a sentence on standard error, 2 wrong usage.
"""

from __future__ import annotations

import signal
import sys

import typer

from app.cli import archive, archive_export, bench, films, lab, reports, server, tokens
from app.cli.console import err
from vo_core import ChainageError

app = typer.Typer(
    name="chainage",
    help="Where in the pipe every frame and every defect is, from the camera alone.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (
    server.demo,
    server.serve,
    server.backup,
    server.restore,
    films.track,
    films.counter,
    films.correct,
    reports.export,
    reports.verify,
    lab.simulate,
    lab.evaluate,
    lab.calibrate,
    lab.advise,
    bench.bench,
):
    app.command()(command)
archive.commands.command("export")(archive_export.export)
app.add_typer(archive.commands, name="archive")
app.add_typer(tokens.commands, name="token")


def main() -> None:
    """Entry point of the `chainage` command."""
    # Like Ctrl+C, so that temporary folders are removed.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        app()
    except (ChainageError, OSError) as error:
        err.print(f"chainage: {error}", style="red")
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(1)
