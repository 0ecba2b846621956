"""The command line: each command checks its words, calls one function elsewhere, shows the result.

Exit codes: 0 done, 1 failed with a sentence on standard error, 2 wrong usage.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

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

from app.intrinsics import read_camera
from app.offline import Method, TrackedVideo, track_video
from vo_core import ChainageError, Pose, Rig, Track

app = typer.Typer(
    name="chainage",
    help="Where in the pipe every frame and every defect is, from the camera alone.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
# No markup: names of files and values out of them hold brackets.
_out = Console(markup=False, highlight=False, soft_wrap=True)
_err = Console(markup=False, highlight=False, soft_wrap=True, stderr=True)

Port = Annotated[int, typer.Option(min=0, max=65535, help="0 takes any free port.")]
Host = Annotated[str, typer.Option(help="Address to listen on.")]


class TrackFormat(StrEnum):
    """Forms of a track file."""

    CSV = "csv"
    TUM = "tum"
    JSON = "json"


class BoardKind(StrEnum):
    """Calibration patterns."""

    CHECKERBOARD = "checkerboard"
    CHARUCO = "charuco"


def main() -> None:
    """Entry point of the `chainage` command."""
    # As Ctrl+C does, so that temporary folders are removed.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        app()
    except (ChainageError, OSError) as error:
        _err.print(f"chainage: {error}", style="red")
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(1)


@app.command()
def demo(host: Host = "127.0.0.1", port: Port = 8000) -> None:
    """Serve the dashboard with a sample culvert inspection that starts by itself."""
    from app.demo import run_demo

    with _progress() as progress:
        # Not seen before the first frame: the port or a setting may be refused before.
        task = progress.add_task("rendering a sample culvert", total=None, visible=False)
        run_demo(
            host,
            port,
            on_progress=partial(_advance, progress, task),
            on_ready=partial(_announce, progress),
        )


@app.command()
def serve(
    host: Host = "127.0.0.1",
    port: Port = 8000,
    data: Annotated[
        Path | None, typer.Option(help="Data folder.  [default: chainage-data or CHAINAGE_DATA]")
    ] = None,
) -> None:
    """Serve the dashboard."""
    from app import main as server
    from app.settings import Settings

    settings = Settings.load() if data is None else Settings.load(data=data)
    server.serve(settings, host, port, lambda url, _: _out.print(f"Open {url}"))


@app.command()
def track(
    video: Annotated[Path, typer.Argument(help="MP4, MOV, MKV, WebM, AVI, MPEG-TS or MPEG.")],
    rig: Annotated[Path, typer.Option(help="Rig file: camera, mount and pipe.")],
    out: Annotated[Path, typer.Option(help="Track file to write.")],
    format: Annotated[TrackFormat, typer.Option(help="Form of the file.")] = TrackFormat.CSV,  # noqa: A002
    method: Annotated[Method, typer.Option(help="How motion is measured.")] = Method.CHAINAGE,
    camera: Annotated[
        Path | None,
        typer.Option(
            help="Take the intrinsics from this file instead of the rig's: ROS camera_info, "
            "Kalibr camchain or OpenCV FileStorage.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Measure the pose of the camera in every frame of a video."""
    _require_folder(out, "--out")
    setup = Rig.load(rig)
    if camera is not None:
        setup = setup.model_copy(update={"camera": read_camera(camera)})
    with _progress() as progress:
        task = progress.add_task(f"tracking {video.name}", total=None)
        result = track_video(
            video,
            setup,
            method,
            on_progress=partial(_advance, progress, task),
        )
    metadata: dict[str, object] = {"video": video.name, "rig": rig.name, "method": method.value}
    if camera is not None:
        metadata["camera"] = camera.name
    out.write_text(_as_text(result, format, metadata), encoding="utf-8")
    lost = int((result.track.status == "lost").sum())
    _out.print(
        f"{out}: {len(result.track)} frames, {result.track.distance_mm[-1] / 1000:.3f} m, "
        f"{lost} frames without a lock"
    )
    if result.problem is not None:
        _err.print(f"warning: {result.problem}", style="yellow")


@app.command()
def simulate(
    folder: Annotated[Path, typer.Argument(help="Gets video.mp4, rig.json and truth.csv.")],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Name of a scenario; several give a folder each; none gives all."),
    ] = None,
) -> None:
    """Render a culvert inspection whose true motion is known."""
    from app.simulation import SCENARIOS
    from app.simulation import simulate as render

    names = scenario or list(SCENARIOS)
    for name in names:
        if name not in SCENARIOS:
            raise typer.BadParameter(
                f"no scenario {name!r}; there are {', '.join(SCENARIOS)}", param_hint="--scenario"
            )
    with _progress() as progress:
        for name in names:
            task = progress.add_task(f"rendering {name}", total=None)
            place = folder if len(names) == 1 else folder / name
            render(SCENARIOS[name], place, partial(_advance, progress, task))
    _out.print(f"{folder}: {', '.join(names)}")


@app.command()
def evaluate(
    track: Annotated[Path, typer.Argument(help="track.csv")],
    truth: Annotated[Path, typer.Argument(help="truth.csv")],
    plot: Annotated[
        Path | None, typer.Option(help="Draw the path and the error of displacement here.")
    ] = None,
) -> None:
    """Compare a track with the truth: distance, ATE, RPE, yaw, honesty of the uncertainty."""
    from app import evaluation

    measured = Track.from_csv(track.read_text(encoding="utf-8"))
    true = evaluation.Truth.from_csv(truth.read_text(encoding="utf-8"))
    table = Table(show_header=False, box=None)
    for name, value in evaluation.evaluate(measured, true).rows():
        table.add_row(name, value)
    _out.print(table)
    if plot is not None:
        evaluation.plot([(track.stem, measured, true)], plot)


@app.command()
def calibrate(
    images: Annotated[list[Path], typer.Argument(help="Pictures of the board, 10 or more.")],
    board: Annotated[BoardKind, typer.Option(help="Pattern of the board.")],
    columns: Annotated[
        int,
        typer.Option(
            min=4,
            max=40,
            help="ChArUco: squares along a row. Checkerboard: inner corners along a row; its "
            "squares are understood too.",
        ),
    ],
    rows: Annotated[int, typer.Option(min=4, max=40, help="The same along a column.")],
    square_mm: Annotated[float, typer.Option(min=0.1, help="Side of a square.")],
    out: Annotated[Path, typer.Option(help="Camera part of a rig file to write.")],
    marker_mm: Annotated[
        float | None, typer.Option(help="Side of a marker; ChArUco only.", show_default=False)
    ] = None,
    model: Annotated[Literal["pinhole", "fisheye"], typer.Option(help="Lens.")] = "pinhole",
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Write a whole rig file, with mount and pipe from this one.", show_default=False
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="Draw coverage and residuals here.", show_default=False),
    ] = None,
) -> None:
    """Camera intrinsics from pictures of a checkerboard or a ChArUco board."""
    from app import calibration

    if (board is BoardKind.CHARUCO) != (marker_mm is not None):
        raise typer.BadParameter(
            "goes with --board charuco and with it alone", param_hint="--marker-mm"
        )
    _require_folder(out, "--out")
    setup = None if rig is None else Rig.load(rig)
    with _progress() as progress:
        task = progress.add_task("looking for the board", total=len(images))
        result = calibration.calibrate_files(
            images,
            calibration.Board(columns, rows, square_mm, marker_mm),
            model,
            on_progress=partial(_advance, progress, task),
        )
    camera = result.camera
    part = camera if setup is None else setup.model_copy(update={"camera": camera})
    out.write_text(part.model_dump_json(indent=2) + "\n", encoding="utf-8")

    table = Table("picture", "corners", "residual", box=None)
    for fit in result.fits:
        table.add_row(fit.view.name, str(len(fit.residual_px)), f"{fit.rms_px:.3f} px")
    for drop in result.dropped:
        table.add_row(drop.name, "-", f"left out: {drop.reason}")
    _out.print(table)
    summary = Table(show_header=False, box=None)
    for name, value in result.rows():
        summary.add_row(name, value)
    _out.print(summary)
    _out.print(f"{out}: {'rig' if setup is not None else 'camera part of a rig'}")
    if report is not None:
        calibration.plot(result, report)


@app.command()
def advise(
    rig: Annotated[Path, typer.Option(help="Rig file: camera, mount and pipe.")],
    move: Annotated[
        str, typer.Option(help="Motion between two frames: mm forward, mm to the right.")
    ] = "15,5",
    frame_rate: Annotated[float, typer.Option(min=0.1, help="Frames per second.")] = 30.0,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Draw the displacement field here, as the paper's figures 2 to 4.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Is this camera in this pipe fit for the method?"""
    from app import advice as drawing
    from vo_core import advice

    motion = _motion(move)
    setup = Rig.load(rig)
    result = advice.advise(setup, motion, frame_rate)
    table = Table(show_header=False, box=None)
    for name, value in drawing.rows(result):
        table.add_row(name, value)
    _out.print(table)
    _out.print(f"verdict: {result.verdict}")
    for finding in result.findings:
        _out.print(f"- {finding.sentence}")
    if plot is not None:
        title = f"{rig.stem}: {motion.x_mm:g} mm forward, {motion.y_mm:g} mm to the right"
        drawing.plot(advice.displacement_field(setup, motion), title, plot)


@app.command()
def bench(
    quick: Annotated[bool, typer.Option("--quick", help="Short runs only.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="Also write OUT.md and OUT.json.", show_default=False)
    ] = None,
) -> None:
    """Accuracy and speed on every scenario, against the paper's method and other peers."""
    from app import bench as benchmark

    scenarios = benchmark.quick_scenarios() if quick else benchmark.all_scenarios()
    with _progress() as progress:
        task = progress.add_task("bench", total=None)

        def report(what: str, done: int, total: int) -> None:
            progress.update(task, description=what, completed=done, total=total)

        rows = benchmark.bench(scenarios, on_progress=report)
    markdown = benchmark.to_markdown(rows)
    typer.echo(markdown)
    if out is not None:
        out.with_suffix(".md").write_text(markdown, encoding="utf-8")
        out.with_suffix(".json").write_text(benchmark.to_json(rows), encoding="utf-8")


def _require_folder(file: Path, option: str) -> None:
    """Known now, not after an hour of work."""
    if not file.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {file.parent}", param_hint=option)


def _motion(words: str) -> Pose:
    try:
        x_mm, y_mm = map(float, words.split(","))
    except ValueError as error:
        raise typer.BadParameter(
            f"{words!r} is not two numbers such as 15,5", param_hint="--move"
        ) from error
    if not 0 < abs(x_mm) + abs(y_mm) < 1e6:
        raise typer.BadParameter(f"{words!r} moves nothing that can be seen", param_hint="--move")
    return Pose(x_mm, y_mm)


def _as_text(result: TrackedVideo, form: TrackFormat, metadata: dict[str, object]) -> str:
    match form:
        case TrackFormat.CSV:
            return result.track.to_csv(metadata)
        case TrackFormat.TUM:
            return result.track.to_tum()
        case TrackFormat.JSON:
            return result.track.to_json(metadata)


@contextmanager
def _progress() -> Iterator[Progress]:
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=_err) as progress:
        yield progress


def _advance(progress: Progress, task: TaskID, done: int, total: int | None) -> None:
    progress.update(task, completed=done, total=total, visible=True)


def _announce(progress: Progress, url: str) -> None:
    progress.stop()
    _out.print(f"Open {url}")
    _out.print("Stop with Ctrl+C.")
