"""The command line: each command checks its words, calls one function elsewhere, shows the result.

Exit codes: 0 done, 1 failed with a sentence on standard error, 2 wrong usage.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from app.cli import reports as cli_reports
from app.cli.console import Data, data_folder, require_folder
from app.cli.console import err as _err
from app.cli.console import out as _out
from app.cli.reports import own_fingerprint
from app.lab.calibration.intrinsics import read_camera
from app.tracking.offline import Method, TrackedVideo, track_video
from vo_core import ChainageError, Pose, Rig
from vo_core.joints.finder import JointFinder, numbered
from vo_core.joints.finder import to_csv as joints_to_csv

if TYPE_CHECKING:
    # A second to import, for few commands.
    from app.storage.backup import Summary
    from app.storage.tokens import TokenFile

app = typer.Typer(
    name="chainage",
    help="Where in the pipe every frame and every defect is, from the camera alone.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
tokens = typer.Typer(
    help="Named access tokens of a data folder, also while a server uses it.", no_args_is_help=True
)
app.add_typer(tokens, name="token")
app.command()(cli_reports.export)
app.command()(cli_reports.verify)

Port = Annotated[int, typer.Option(min=0, max=65535, help="0 takes any free port.")]
Host = Annotated[str, typer.Option(help="Address to listen on.")]

_NAME_LENGTH = 100
_MIB = 2**20


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
    from app.cli.demo import run_demo

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
    data: Data = None,
    tls_cert: Annotated[
        Path | None, typer.Option(help="Certificate (PEM): serve over https.", show_default=False)
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(help="Private key of the certificate.", show_default=False)
    ] = None,
    insecure_lan: Annotated[
        bool,
        typer.Option("--insecure-lan", help="Let other machines in without https; pages warn."),
    ] = False,
) -> None:
    """Serve the dashboard."""
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
        _out.print(f"Open {url}")
        try:
            _out.print(f"Evidence bundles are signed with the key {own_fingerprint(settings.data)}")
        except (ChainageError, OSError) as error:  # all else works without it
            _err.print(f"warning: {error}", style="yellow")

    server.serve(settings, host, port, announce)


@tokens.command("create")
def create_token(
    name: Annotated[str, typer.Argument(help="Who will use it; the history shows this name.")],
    role: Annotated[
        Literal["viewer", "operator", "admin"],
        typer.Option(
            help="viewer: looks and exports.  operator: inspects, tags and corrects, too.  "
            "admin: also deletes inspections and changes code packs."
        ),
    ],
    data: Data = None,
) -> None:
    """Make a token and print it, this once."""
    from app.access.access import SERVER
    from app.access.access import create_token as create
    from app.storage.tokens import Role

    if not (name == name.strip() and name.isprintable() and 0 < len(name) <= _NAME_LENGTH):
        raise typer.BadParameter(f"has 1 to {_NAME_LENGTH} printable characters", param_hint="NAME")
    if name == SERVER:
        raise typer.BadParameter("is the name of the server's own token", param_hint="NAME")
    file = _token_file(data)
    secret = create(file, name, Role(role))
    _err.print(f"Token {name} ({role}) for {file.folder}; it is not shown again:")
    _out.print(secret)


@tokens.command("list")
def list_tokens(data: Data = None) -> None:
    """Show the named tokens, the revoked ones too."""
    table = Table("name", "role", "created", "revoked", box=None)
    for token in _token_file(data).all():
        table.add_row(token.name, token.role, _day(token.created_at), _day(token.revoked_at))
    _out.print(table)


@tokens.command("revoke")
def revoke_token(
    name: Annotated[str, typer.Argument(help="Of the token.")], data: Data = None
) -> None:
    """End a token and all that is logged in with it, at once."""
    file = _token_file(data)
    file.revoke(name)
    _err.print(f"Token {name} for {file.folder} is revoked.")


@app.command()
def backup(
    file: Annotated[Path, typer.Argument(help="Archive to write (ZIP); it is replaced whole.")],
    data: Data = None,
) -> None:
    """Put a data folder into an archive; a server may go on using it.

    Left out are the server's own token and uploads of which no inspection was made.
    """
    from app.storage import backup as archives

    require_folder(file, "FILE")
    folder = data_folder(data)
    with _progress() as progress:
        task = progress.add_task("backing up, MiB", total=None)
        done = archives.back_up(folder, file, partial(_advance_mib, progress, task))
    _out.print(f"{file}: {_told(done)}")
    for name in done.missing:
        _err.print(f"warning: {name} is missing in {folder}", style="yellow")


@app.command()
def restore(
    file: Annotated[Path, typer.Argument(help="Archive that `chainage backup` wrote.")],
    data: Data = None,
) -> None:
    """Make a data folder of an archive, after every file in it was checked."""
    from app.storage import backup as archives

    folder = data_folder(data)
    require_folder(folder, "--data")
    with _progress() as progress:
        task = progress.add_task("restoring, MiB", total=None)
        done = archives.restore(file, folder, partial(_advance_mib, progress, task))
    _out.print(f"{folder}: {_told(done)}")


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
    joints: Annotated[
        Path | None,
        typer.Option(help="Write the joints that were seen here.", show_default=False),
    ] = None,
) -> None:
    """Measure the pose of the camera in every frame of a video."""
    require_folder(out, "--out")
    if joints is not None:
        require_folder(joints, "--joints")
    setup = Rig.load(rig)
    if camera is not None:
        setup = setup.model_copy(update={"camera": read_camera(camera)})
    finder = None if joints is None else JointFinder(setup)
    with _progress() as progress:
        task = progress.add_task(f"tracking {video.name}", total=None)
        result = track_video(
            video,
            setup,
            method,
            on_progress=partial(_advance, progress, task),
            finder=finder,
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
    if joints is not None and finder is not None:
        seen = finder.finish()
        joints.write_text(joints_to_csv(result.track, seen, metadata), encoding="utf-8")
        _out.print(f"{joints}: {len(set(numbered(result.track, seen)))} joints")
    if result.problem is not None:
        _err.print(f"warning: {result.problem}", style="yellow")


@app.command()
def correct(
    track: Annotated[Path, typer.Argument(help="track.csv as it was measured.")],
    out: Annotated[Path, typer.Option(help="Corrected track file to write.")],
    length: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FRAME:FRAME=METRES[±MM]",
            help="A taped length between the camera's places in two frames, or the pipe's own; "
            "0 is the first frame. ± (or +-) is its standard uncertainty, 5 mm unless given. May "
            "be given again.",
        ),
    ] = None,
    joints: Annotated[
        Path | None,
        typer.Option(
            help="Joints as `chainage track --joints` wrote them; the rig says how far apart "
            "they are.",
            show_default=False,
        ),
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Rig file with which the track was made; with it the height is reported too.",
            show_default=False,
        ),
    ] = None,
    height_sigma_mm: Annotated[
        float,
        typer.Option(
            min=0, help="How well the rig's height is known, one sigma; 0: as its tolerance says."
        ),
    ] = 0.0,
    focal_sigma_px: Annotated[
        float,
        typer.Option(
            min=0, help="How well its focal length is known, one sigma; 0: as its tolerance says."
        ),
    ] = 0.0,
) -> None:
    """Bring a finished track to scale by known lengths and joints, without decoding again."""
    from app.survey import correct_track as correction

    try:
        lengths = [correction.parse_length(words) for words in length or ()]
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--length") from error
    stated = max(height_sigma_mm, focal_sigma_px) > 0
    if not (lengths or joints or stated):
        raise typer.BadParameter(
            "nothing to correct by; give --length, --joints or --height-sigma-mm",
            param_hint="--length",
        )
    if rig is None and (joints is not None or stated):
        raise typer.BadParameter("is needed by the other options", param_hint="--rig")
    require_folder(out, "--out")
    if out.resolve() == track.resolve():
        raise typer.BadParameter("would replace the raw track", param_hint="--out")
    result = correction.correct_file(
        track,
        lengths=lengths,
        joints_file=joints,
        rig=None if rig is None else Rig.load(rig),
        height_sigma_mm=height_sigma_mm,
        focal_sigma_px=focal_sigma_px,
    )
    out.write_text(result.correction.track.to_csv(result.metadata), encoding="utf-8")
    table = Table("known", "measured", "residual", box=None)
    for left in result.correction.residuals:
        table.add_row(left.name, f"{left.measured_mm / 1000:.3f} m", f"{left.residual_mm:+.1f} mm")
    if lengths or joints:
        _out.print(table)
    _print_rows(result.rows())
    if result.by_joints is not None:
        _out.print(str(result.by_joints))
    _out.print(f"{out}: corrected track")


@app.command()
def simulate(
    folder: Annotated[Path, typer.Argument(help="Gets video.mp4, rig.json and truth.csv.")],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Name of a scenario; several give a folder each; none gives all."),
    ] = None,
) -> None:
    """Render a culvert inspection whose true motion is known."""
    from app.lab.simulation import SCENARIOS
    from app.lab.simulation import simulate as render

    names = scenario or [name for name, one in SCENARIOS.items() if one.is_available]
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
    left_out = [name for name, one in SCENARIOS.items() if not one.is_available]
    if not scenario and left_out:
        _err.print(
            f"left out: {', '.join(left_out)} (photographs that come with scikit-image: "
            "pip install scikit-image)",
            style="yellow",
        )


@app.command()
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
        _require_picture(plot, "--plot")
    runs = evaluation.load_runs(list(zip(files[::2], files[1::2], strict=True)))
    results = [evaluation.evaluate(run.track, run.truth) for run in runs]
    if len(runs) == 1:
        _print_rows(results[0].rows())
    else:
        table = Table(*evaluation.SUMMARY_HEADINGS, box=None, padding=(0, 1, 0, 0))
        for run, result in zip(runs, results, strict=True):
            table.add_row(*evaluation.summary_row(run.name, result))
        _out.print(table)
        errors = [evaluation.errors_of(run.track, run.truth) for run in runs]
        _print_rows(evaluation.displacement_error(errors).rows(), title="all runs together")
    for run, result in zip(runs, results, strict=True):
        if result.missing_frames or result.surplus_frames:
            _err.print(
                f"warning: {run.name}: track and truth are not of the same frames "
                f"({result.missing_frames} missing, {result.surplus_frames} beyond the truth); "
                "compared are those that both have",
                style="yellow",
            )
    if plot is not None:
        evaluation.plot(runs, plot)


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
    from app.lab import calibration

    if (board is BoardKind.CHARUCO) != (marker_mm is not None):
        raise typer.BadParameter(
            "goes with --board charuco and with it alone", param_hint="--marker-mm"
        )
    require_folder(out, "--out")
    if report is not None:
        _require_picture(report, "--report")
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
    part = camera if setup is None else result.into(setup)
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
    from app.lab import advice as drawing
    from vo_core import advice

    motion = _motion(move)
    if plot is not None:
        _require_picture(plot, "--plot")
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
    quick: Annotated[
        bool, typer.Option("--quick", help="A few scenarios over a short path: two minutes.")
    ] = False,
    field: Annotated[
        bool,
        typer.Option(
            "--field", help="Accuracy of Chainage alone on ten scenarios of the field: ten minutes."
        ),
    ] = False,
    metres: Annotated[
        float | None,
        typer.Option(
            min=0.2,
            max=6.0,
            help="Path of each scenario; the targets are for 6.  [default: 2; 6 with --field; "
            "0.25 with --quick]",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Also write OUT.md and OUT.json.", show_default=False)
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.png",
            help="Compare the stated interval with the actual error instead, over 200 rigs that "
            "are wrong by their tolerance (20 with --quick), and draw it here.",
            show_default=False,
        ),
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md",
            help="Also replace the figures in this file, between <!-- bench:begin --> and "
            "<!-- bench:end --> (bench-field with --field, bench-intervals with --calibration).",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Accuracy and speed on every scenario, against the paper's method and other peers."""
    from app.lab import bench as benchmark
    from app.lab import markdown_figures as figures
    from app.lab.simulation import SCENARIOS

    if field and (quick or calibration is not None):
        raise typer.BadParameter("goes without --quick and --calibration", param_hint="--field")
    if out is not None:
        require_folder(out, "--out")
    name = "bench-intervals" if calibration else "bench-field" if field else "bench"
    if write is not None:
        _require_markers(write, name)

    with _progress() as progress:
        task = progress.add_task("bench", total=None)

        def report(what: str, done: int, total: int) -> None:
            progress.update(task, description=what, completed=done, total=total)

        if calibration is not None:
            markdown = _calibrate_interval(calibration, report, quick=quick)
        else:
            track_time = None
            if field:
                default_mm, choose = benchmark.FIELD_LENGTH_MM, benchmark.field_scenarios
            elif quick:
                default_mm, choose = benchmark.QUICK_LENGTH_MM, benchmark.quick_scenarios
            else:
                default_mm, choose = benchmark.LENGTH_MM, benchmark.all_scenarios
            scenarios = choose(default_mm if metres is None else 1000 * metres)
            methods = benchmark.OURS_ALONE if field else benchmark.METHODS
            rows = benchmark.bench(scenarios, methods=methods, on_progress=report)
            if field:
                markdown = benchmark.to_short_markdown(rows)
            else:
                track_time = benchmark.time_track(SCENARIOS["nominal"], 1 if quick else 3, report)
                markdown = benchmark.to_markdown(rows, track_time)
            if out is not None:
                json = benchmark.to_json(rows, track_time)
                out.with_suffix(".md").write_text(markdown, encoding="utf-8")
                out.with_suffix(".json").write_text(json, encoding="utf-8")
    typer.echo(markdown)
    if write is not None:
        words = [f"--calibration {calibration}"] * (calibration is not None)
        words += ["--quick"] * quick + ["--field"] * field
        words += [f"--metres {metres:g}"] * (metres is not None)
        command = " ".join(["chainage bench", *words])
        figures.write_figures(write, name, command, markdown)


def _require_markers(file: Path, name: str) -> None:
    """Known now, not after an hour of work."""
    from app.lab.markdown_figures import replace_figures

    try:
        replace_figures(file.read_text(encoding="utf-8"), name, "")
    except (OSError, ValueError) as error:
        raise typer.BadParameter(f"{file}: {error}", param_hint="--write") from error


def _calibrate_interval(plot: Path, report: Callable[[str, int, int], None], *, quick: bool) -> str:
    from app.lab import intervals

    _require_picture(plot, "--calibration")
    rigs = intervals.QUICK_RIGS if quick else intervals.RIGS
    trials = intervals.run_trials(intervals.films(), rigs, report)
    intervals.plot(trials, plot)
    return intervals.to_markdown(trials)


def _token_file(data: Path | None) -> TokenFile:
    from app.storage.tokens import TokenFile

    return TokenFile(data_folder(data))


def _day(instant: datetime | None) -> str:
    return "-" if instant is None else f"{instant.astimezone():%Y-%m-%d %H:%M}"


def _require_picture(file: Path, option: str) -> None:
    require_folder(file, option)
    if file.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise typer.BadParameter(f"{file.name} is not .png, .pdf or .svg", param_hint=option)


def _print_rows(rows: Iterable[tuple[str, str]], title: str | None = None) -> None:
    table = Table(show_header=False, box=None, title=title, title_justify="left")
    for name, value in rows:
        table.add_row(name, value)
    _out.print(table)


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


def _advance_mib(progress: Progress, task: TaskID, done: int, total: int) -> None:
    _advance(progress, task, round(done / _MIB), round(total / _MIB))


def _told(summary: Summary) -> str:
    return (
        f"{summary.inspections} inspections, {summary.observations} observations, "
        f"{summary.files} files, {summary.size_bytes / _MIB:.1f} MiB"
    )


def _announce(progress: Progress, url: str) -> None:
    progress.stop()
    _out.print(f"Open {url}")
    _out.print("Stop with Ctrl+C.")
