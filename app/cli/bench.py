"""The command `bench`: which measurement its options choose, and where the figures go."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.console import progress_bar, require_picture

if TYPE_CHECKING:
    from app.lab.bench.run import Progress


def bench(
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Chainage alone on a short sequence for each mechanism, beside the recorded "
            "figures; the exit code is 1 if one is worse beyond its noise: five minutes.",
        ),
    ] = False,
    record: Annotated[
        bool,
        typer.Option(
            "--record",
            help="With --quick: record the figures anew.",
        ),
    ] = False,
    field: Annotated[
        bool,
        typer.Option(
            "--field", help="Accuracy of Chainage alone on ten scenarios of the field: ten minutes."
        ),
    ] = False,
    forward: Annotated[
        bool,
        typer.Option(
            "--forward", help="The forward view as crews have it, beside its peers: half an hour."
        ),
    ] = False,
    findings: Annotated[
        bool,
        typer.Option(
            "--findings",
            help="What the search of the wall finds, on painted walls, on films and, with "
            "--pictures, on photographs: a quarter of an hour.",
        ),
    ] = False,
    pictures: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            file_okay=False,
            exists=True,
            help="With --findings: a folder of photographs NAME.jpg with masks NAME_mask.png.",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="With --forward or --findings: the seed of lenses, mounts and walls.  "
            "[default: 1]",
        ),
    ] = None,
    metres: Annotated[
        float | None,
        typer.Option(
            min=0.2,
            max=6.0,
            help="Path of each scenario; the targets are for 6.  [default: 2; 6 with --field; "
            "as each scenario states with --forward]",
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.png",
            help="Instead compare the stated interval with the actual error, over 200 rigs that "
            "are wrong by their tolerance (20 with --quick), and draw it here.",
        ),
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md",
            help="Also replace the figures in this file, between <!-- bench:begin --> and "
            "<!-- bench:end --> (bench-field with --field, bench-forward with --forward, "
            "bench-findings with --findings, bench-intervals with --calibration).",
        ),
    ] = None,
) -> None:
    """Measure accuracy and speed on every scenario, against the paper's method and other peers."""
    from app.lab import markdown_figures as figures
    from app.lab.bench.choices import CHOICES

    kinds = {"--quick": quick, "--field": field, "--forward": forward, "--findings": findings}
    chosen = [option for option, is_chosen in kinds.items() if is_chosen]
    if len(chosen) > 1 or (calibration is not None and (field or forward or findings)):
        raise typer.BadParameter(
            "cannot be combined with another choice of scenarios", param_hint=chosen[-1]
        )
    if seed is not None and not (forward or findings):
        raise typer.BadParameter("is for --forward and --findings only", param_hint="--seed")
    if pictures is not None and not findings:
        raise typer.BadParameter("is for --findings only", param_hint="--pictures")
    if metres is not None and findings:
        raise typer.BadParameter("has walls of its own", param_hint="--findings")
    is_guard = quick and calibration is None
    if record and not is_guard:
        raise typer.BadParameter("is for --quick only", param_hint="--record")
    if is_guard:
        if metres is not None or write is not None:
            raise typer.BadParameter("has its own paths and files", param_hint="--quick")
        _guard(record=record)
        return
    mark = _mark("".join(chosen), is_calibration=calibration is not None)
    if write is not None:
        _require_markers(write, mark)

    with _progress() as report:
        if calibration is not None:
            markdown = _calibrate_interval(calibration, report, quick=quick)
        elif findings:
            markdown = _measure_findings(pictures, seed or 1, report)
        else:
            length_mm = None if metres is None else 1000 * metres
            markdown = CHOICES["".join(chosen)].measure(length_mm, seed or 1, report)
    typer.echo(markdown)
    if write is not None:
        words = ["chainage bench"]
        words += [] if calibration is None else [f"--calibration {calibration}"]
        words += chosen
        words += [] if pictures is None else ["--pictures DIR"]
        words += [] if seed is None else [f"--seed {seed}"]
        words += [] if metres is None else [f"--metres {metres:g}"]
        figures.write_figures(write, mark, " ".join(words), markdown)


@contextmanager
def _progress() -> Iterator[Progress]:
    with progress_bar() as progress:
        task = progress.add_task("bench", total=None)

        def report(what: str, done: int, total: int) -> None:
            progress.update(task, description=what, completed=done, total=total)

        yield report


def _guard(*, record: bool) -> None:
    """Compare the short sequences with their recorded figures, or record them."""
    from app.lab.bench import quick, recorded

    if not (record or quick.RECORD.exists()):
        raise typer.BadParameter(
            f"{quick.RECORD} does not exist: the recorded figures lie beside the sources, "
            "not in an installed package",
            param_hint="--quick",
        )
    before = recorded.read(quick.RECORD) if quick.RECORD.exists() else {}
    with _progress() as report:
        now = quick.measure(quick.DRAWS if record else 1, report)
    changed = list(recorded.changes(before, now))
    typer.echo(quick.to_markdown(before, now, changed))
    if record:
        quick.keep(now)
    elif any(change.fails for change in changed):
        raise typer.Exit(1)


def _mark(chosen: str, *, is_calibration: bool) -> str:
    """Name of the markers between which the figures stand."""
    from app.lab.bench.choices import CHOICES

    if is_calibration:
        return "bench-intervals"
    return "bench-findings" if chosen == "--findings" else CHOICES[chosen].mark


def _measure_findings(pictures: Path | None, seed: int, report: Progress) -> str:
    from app.lab.findings.bench import measure
    from app.lab.findings.photographs import NoPictures

    try:
        return measure(pictures, seed, report)
    except NoPictures as error:
        raise typer.BadParameter(str(error), param_hint="--pictures") from error


def _require_markers(file: Path, name: str) -> None:
    """Check that the file has the markers, before the work starts."""
    from app.lab.markdown_figures import replace_figures

    try:
        replace_figures(file.read_text(encoding="utf-8"), name, "")
    except (OSError, ValueError) as error:
        raise typer.BadParameter(f"{file}: {error}", param_hint="--write") from error


def _calibrate_interval(plot: Path, report: Progress, *, quick: bool) -> str:
    from app.lab import intervals

    require_picture(plot, "--calibration")
    rigs = intervals.QUICK_RIGS if quick else intervals.RIGS
    trials = intervals.run_trials(intervals.films(), rigs, report)
    intervals.plot(trials, plot)
    return intervals.to_markdown(trials)
