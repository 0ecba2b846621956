"""The commands of the lab: simulate, evaluate, calibrate, advise."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.table import Table

from app.cli.console import (
    advance,
    err,
    print_rows,
    progress_bar,
    require_folder,
    require_picture,
)
from app.cli.console import out as console

if TYPE_CHECKING:
    from vo_core import Pose  # slow to import, and few commands need it


def simulate(
    folder: Annotated[Path, typer.Argument(help="Folder for video.mp4, rig.json and truth.csv.")],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Name of a scenario; several give a folder each; none gives all."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Draw lens, mount and wall of a forward scenario at random, as `bench` does.",
        ),
    ] = None,
) -> None:
    """Render a culvert inspection whose true motion is known."""
    from app.lab.simulation import SCENARIOS, with_drawn_rig
    from app.lab.simulation import simulate as render

    names = scenario or [name for name, one in SCENARIOS.items() if one.is_available]
    for name in names:
        if name not in SCENARIOS:
            raise typer.BadParameter(
                f"no scenario {name!r}; there are {', '.join(SCENARIOS)}", param_hint="--scenario"
            )
    with progress_bar() as progress:
        for name in names:
            task = progress.add_task(f"rendering {name}", total=None)
            place = folder if len(names) == 1 else folder / name
            one = SCENARIOS[name] if seed is None else with_drawn_rig(SCENARIOS[name], seed)
            render(one, place, partial(advance, progress, task))
    console.print(f"{folder}: {', '.join(names)}")
    left_out = [name for name, one in SCENARIOS.items() if not one.is_available]
    if not scenario and left_out:
        err.print(
            f"left out: {', '.join(left_out)} (photographs that come with scikit-image: "
            "pip install scikit-image)",
            style="yellow",
        )


def evaluate(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="TRACK TRUTH [TRACK TRUTH]...", help="track.csv and truth.csv of each run."
        ),
    ],
    plot: Annotated[
        Path | None, typer.Option(help="Draw the paths and the errors of displacement here.")
    ] = None,
) -> None:
    """Compare tracks with the truth: distance, ATE, RPE, yaw, honesty of the uncertainty."""
    from app.lab import evaluation

    if len(files) % 2:
        raise typer.BadParameter(
            f"every track needs a truth after it; there are {len(files)} files",
            param_hint="TRACK TRUTH",
        )
    if plot is not None:
        require_picture(plot, "--plot")
    runs = evaluation.load_runs(list(zip(files[::2], files[1::2], strict=True)))
    results = [evaluation.evaluate(run.track, run.truth) for run in runs]
    if len(runs) == 1:
        print_rows(results[0].rows())
    else:
        table = Table("run", *evaluation.SUMMARY, box=None, padding=(0, 1, 0, 0))
        for run, result in zip(runs, results, strict=True):
            figures = (figure(result) for figure in evaluation.SUMMARY.values())
            table.add_row(run.name, *figures)
        console.print(table)
        errors = [evaluation.errors_of(run.track, run.truth) for run in runs]
        print_rows(evaluation.displacement_error(errors).rows(), title="all runs together")
    for run, result in zip(runs, results, strict=True):
        if result.missing_frames or result.surplus_frames:
            err.print(
                f"warning: {run.name}: track and truth do not have the same frames "
                f"({result.missing_frames} missing, {result.surplus_frames} beyond the truth); "
                "only the frames of both are compared",
                style="yellow",
            )
    if plot is not None:
        evaluation.plot(runs, plot)


def calibrate(
    out: Annotated[Path, typer.Option(help="Rig file, or its camera part, to write.")],
    images: Annotated[
        list[Path] | None, typer.Argument(help="Pictures of the board, 10 or more.")
    ] = None,
    board: Annotated[
        Literal["checkerboard", "charuco"] | None, typer.Option(help="Pattern of the board.")
    ] = None,
    columns: Annotated[
        int | None,
        typer.Option(
            min=4,
            max=40,
            help="ChArUco: squares along a row. Checkerboard: inner corners along a row; the "
            "number of its squares is accepted too.",
        ),
    ] = None,
    rows: Annotated[
        int | None, typer.Option(min=4, max=40, help="Squares or corners along a column.")
    ] = None,
    square_mm: Annotated[float | None, typer.Option(min=0.1, help="Side of a square.")] = None,
    marker_mm: Annotated[float | None, typer.Option(help="Side of a marker; ChArUco only.")] = None,
    model: Annotated[
        Literal["pinhole", "fisheye"], typer.Option(help="Lens; with a board only.")
    ] = "pinhole",
    rig: Annotated[
        Path | None, typer.Option(help="Write a whole rig file, with mount and pipe from this one.")
    ] = None,
    from_video: Annotated[
        Path | None,
        typer.Option(
            metavar="VIDEO",
            help="Instead make a rig from a film of a camera that looks along the pipe.",
        ),
    ] = None,
    diameter_mm: Annotated[
        float | None, typer.Option(min=50, max=20_000, help="Inner diameter of the film's pipe.")
    ] = None,
    segment_mm: Annotated[
        float | None,
        typer.Option(min=100, max=20_000, help="Distance from joint to joint in the film's pipe."),
    ] = None,
    length_m: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            max=100_000,
            help="Inspected length: from the film's first frame to the furthest place.",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            help="Draw coverage and residuals here; of a film, the wall's grid at five places."
        ),
    ] = None,
) -> None:
    """Measure a camera from pictures of a board, or make a rig from a film of a known pipe."""
    require_folder(out, "--out")
    if report is not None:
        require_picture(report, "--report")
    of_board: dict[str, object] = {
        "IMAGES": images,
        "--board": board,
        "--columns": columns,
        "--rows": rows,
        "--square-mm": square_mm,
    }
    if from_video is not None:
        of_board |= {"--marker-mm": marker_mm, "--rig": rig}
        _refuse_given(of_board, "cannot be combined with --from-video")
        if diameter_mm is None:
            raise typer.BadParameter("is required with --from-video", param_hint="--diameter-mm")
        length_mm = None if length_m is None else 1000 * length_m
        _calibrate_from_a_film(from_video, diameter_mm, segment_mm, length_mm, out, report)
        return
    if not (images and board and columns and rows and square_mm):
        missing = [name for name, value in of_board.items() if not value]
        raise typer.BadParameter(
            "is required, unless --from-video is given", param_hint=" ".join(missing)
        )
    of_film = {"--diameter-mm": diameter_mm, "--segment-mm": segment_mm, "--length-m": length_m}
    _refuse_given(of_film, "is allowed with --from-video only")
    if (board == "charuco") != (marker_mm is not None):
        raise typer.BadParameter(
            "is required with --board charuco, and allowed with it only", param_hint="--marker-mm"
        )
    _calibrate_on_a_board(images, (columns, rows, square_mm, marker_mm), model, rig, out, report)


def _refuse_given(options: Mapping[str, object], why: str) -> None:
    if given := [name for name, value in options.items() if value]:
        raise typer.BadParameter(why, param_hint=" ".join(given))


def _calibrate_on_a_board(
    images: list[Path],
    printed: tuple[int, int, float, float | None],
    model: Literal["pinhole", "fisheye"],
    rig: Path | None,
    out: Path,
    report: Path | None,
) -> None:
    from app.lab.calibration.boards import Board
    from app.lab.calibration.fitting import calibrate_files
    from app.lab.calibration.report import plot
    from vo_core import Rig

    setup = None if rig is None else Rig.load(rig)
    with progress_bar() as progress:
        task = progress.add_task("looking for the board", total=len(images))
        result = calibrate_files(
            images,
            Board(*printed),
            model,
            on_progress=partial(advance, progress, task),
        )
    camera = result.camera
    part = camera if setup is None else result.into(setup)
    out.write_text(part.model_dump_json(indent=2) + "\n", encoding="utf-8")

    table = Table("picture", "corners", "residual", box=None)
    for fit in result.fits:
        table.add_row(fit.view.name, str(len(fit.residual_px)), f"{fit.rms_px:.3f} px")
    for drop in result.dropped:
        table.add_row(drop.name, "-", f"left out: {drop.reason}")
    console.print(table)
    print_rows(result.rows())
    console.print(f"{out}: {'rig' if setup is not None else 'camera part of a rig'}")
    if report is not None:
        plot(result, report)


def _calibrate_from_a_film(
    video: Path,
    diameter_mm: float,
    segment_mm: float | None,
    length_mm: float | None,
    out: Path,
    report: Path | None,
) -> None:
    from app.lab.film_rig.calibrate import KnownPipe, calibrate_film
    from app.lab.film_rig.report import plot

    with progress_bar() as progress:
        task = progress.add_task(f"looking at {video.name}", total=None)

        def show(what: str, done: int, total: int | None) -> None:
            progress.update(task, description=what, completed=done, total=total)

        pipe = KnownPipe(diameter_mm, segment_mm, length_mm)
        found = calibrate_film(video, pipe, show)
    out.write_text(found.rig.model_dump_json(indent=2) + "\n", encoding="utf-8")
    print_rows(found.rows())
    for sentence in found.findings():
        console.print(f"- {sentence}")
    console.print(f"{out}: rig")
    if report is not None:
        plot(found, report)


def advise(
    rig: Annotated[Path, typer.Option(help="Rig file: camera, mount and pipe.")],
    move: Annotated[
        str, typer.Option(help="Motion between two frames: mm forward, mm to the right.")
    ] = "15,5",
    frame_rate: Annotated[float, typer.Option(min=0.1, help="Frames per second.")] = 30.0,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw the displacement field here, as the paper's figures 2 to 4."),
    ] = None,
) -> None:
    """Judge whether this camera in this pipe is fit for the method."""
    from app.lab import advice as drawing
    from vo_core import Rig, advice

    motion = _motion(move)
    if plot is not None:
        require_picture(plot, "--plot")
    setup = Rig.load(rig)
    result = advice.advise(setup, motion, frame_rate)
    print_rows(drawing.rows(result))
    console.print(f"verdict: {result.verdict}")
    for finding in result.findings:
        console.print(f"- {finding.sentence}")
    if plot is not None:
        title = f"{rig.stem}: {motion.x_mm:g} mm forward, {motion.y_mm:g} mm to the right"
        drawing.plot(advice.displacement_field(setup, motion), title, plot)


def _motion(words: str) -> Pose:
    from vo_core import Pose

    try:
        x_mm, y_mm = map(float, words.split(","))
    except ValueError as error:
        raise typer.BadParameter(
            f"{words!r} is not two numbers such as 15,5", param_hint="--move"
        ) from error
    if not 0 < abs(x_mm) + abs(y_mm) < 1e6:
        raise typer.BadParameter(f"{words!r} is no visible motion", param_hint="--move")
    return Pose(x_mm, y_mm)
