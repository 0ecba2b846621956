"""The commands that process a film without a server: track, counter, correct."""

from __future__ import annotations

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
)
from app.cli.console import out as console

if TYPE_CHECKING:  # slow to import, and few commands need them
    from app.burnt_in.box import Box
    from vo_core.scale.counter import CounterComparison


def track(
    video: Annotated[Path, typer.Argument(help="MP4, MOV, MKV, WebM, AVI, MPEG-TS or MPEG.")],
    rig: Annotated[Path, typer.Option(help="Rig file: camera, mount and pipe.")],
    out: Annotated[Path, typer.Option(help="Track file to write.")],
    format: Annotated[  # noqa: A002
        Literal["csv", "tum", "json"], typer.Option(help="Format of the file.")
    ] = "csv",
    method: Annotated[
        Literal["chainage", "paper"], typer.Option(help="How motion is measured.")
    ] = "chainage",
    camera: Annotated[
        Path | None,
        typer.Option(
            help="Take the intrinsics from this file instead of the rig's: ROS camera_info, "
            "Kalibr camchain or OpenCV FileStorage."
        ),
    ] = None,
    joints: Annotated[
        Path | None, typer.Option(help="Write the detected joints to this file.")
    ] = None,
) -> None:
    """Measure the pose of the camera in every frame of a video."""
    from app.lab.calibration.intrinsics import read_camera
    from app.tracking.films.offline import Method, track_video
    from vo_core import Rig
    from vo_core.joints.finder import JointFinder
    from vo_core.joints.sightings import crests, numbered, rings
    from vo_core.joints.sightings import to_csv as joints_to_csv

    require_folder(out, "--out")
    if joints is not None:
        require_folder(joints, "--joints")
    setup = Rig.load(rig)
    if camera is not None:
        setup = setup.model_copy(update={"camera": read_camera(camera)})
    finder = None if joints is None else JointFinder(setup)
    with progress_bar() as progress:
        task = progress.add_task(f"tracking {video.name}", total=None)
        result = track_video(
            video,
            setup,
            Method(method),
            on_progress=partial(advance, progress, task),
            finder=finder,
        )
    metadata: dict[str, object] = {"video": video.name, "rig": rig.name, "method": method}
    if camera is not None:
        metadata["camera"] = camera.name
    measured = result.track
    if format == "tum":
        text = measured.to_tum()
    else:
        text = measured.to_csv(metadata) if format == "csv" else measured.to_json(metadata)
    out.write_text(text, encoding="utf-8")
    lost = int((measured.status == "lost").sum())
    console.print(
        f"{out}: {len(measured)} frames, {measured.distance_mm[-1] / 1000:.3f} m, "
        f"{lost} frames without a lock"
    )
    if joints is not None and finder is not None:
        seen = finder.finish()
        joints.write_text(joints_to_csv(measured, seen, metadata), encoding="utf-8")
        counted = f"{len(set(numbered(measured, rings(seen))))} joints"
        if waves := crests(seen):
            counted += f", crests of waves at {len(waves)} places"
        console.print(f"{joints}: {counted}")
    if result.problem is not None:
        err.print(f"warning: {result.problem}", style="yellow")


def counter(
    video: Annotated[Path, typer.Argument(help="MP4, MOV, MKV, WebM, AVI, MPEG-TS or MPEG.")],
    out: Annotated[Path, typer.Option(help="Table of the readings to write, CSV.")],
    box: Annotated[
        str | None,
        typer.Option(
            metavar="U,V,W,H",
            help="Where the counter stands: left, top, width and height of a part of the picture, "
            "in pixels. Without it, the counter is found.",
        ),
    ] = None,
    track: Annotated[
        Path | None, typer.Option(help="Compare the readings with this track.csv of the film.")
    ] = None,
    unit: Annotated[
        Literal["m", "ft"] | None,
        typer.Option(help="Unit of a counter that shows none; for --track."),
    ] = None,
    comparison: Annotated[
        Path | None, typer.Option(help="Write the comparison with --track here, JSON.")
    ] = None,
) -> None:
    """Read the burnt-in distance counter of a film in every frame."""
    from app.burnt_in.comparison import comparison_to_json, with_track
    from app.burnt_in.counter import burnt_in, read_counter
    from vo_core import Track
    from vo_core.csv_rows import decoded

    require_folder(out, "--out")
    if comparison is not None:
        require_folder(comparison, "--comparison")
    if track is None and (unit is not None or comparison is not None):
        raise typer.BadParameter("is needed by the other options", param_hint="--track")
    measured = None if track is None else Track.from_csv(decoded(track.read_bytes()))
    within = None if box is None else _box(box, video)
    with progress_bar() as progress:
        task = progress.add_task(f"reading {video.name}", total=None)
        place = burnt_in(video, within).place
        readings = read_counter(video, place, partial(advance, progress, task))
    out.write_text(readings.to_csv(), encoding="utf-8")
    console.print(f"{out}: {readings}")
    if readings.place is None:
        err.print(
            f"warning: no counter was found in {video.name}, so every reading is empty; state its "
            "place with --box if there is one",
            style="yellow",
        )
    if readings.problem is not None:
        err.print(f"warning: {readings.problem}", style="yellow")
    if measured is not None and readings.place is not None:
        found = with_track(readings, measured, unit)
        _print_comparison(found)
        if comparison is not None:
            comparison.write_text(comparison_to_json(found), encoding="utf-8")


def _print_comparison(found: CounterComparison) -> None:
    console.print(str(found))
    if found.faults:
        table = Table("counter", "frames", "it counted", "the camera drove", box=None)
        for fault in found.faults:
            table.add_row(
                fault.kind,
                f"{fault.first_frame} to {fault.last_frame}",
                f"{fault.counter_mm / 1000:+.2f} m",
                f"{fault.camera_mm / 1000:+.2f} m",
            )
        console.print(table)
    if (known := found.length) is not None:
        console.print(
            "to correct the track by the counter: chainage correct --length "
            f"{known.first_frame}:{known.last_frame}={known.length_mm / 1000:.3f}"
            f"±{known.sigma_mm:.0f}"
        )


def _box(words: str, video: Path) -> Box:
    """Parse `U,V,W,H` and check that it lies within the picture."""
    from app.burnt_in.box import Box
    from vo_core import VideoFile

    try:
        left, top, width, height = (int(word) for word in words.split(","))
    except ValueError as error:
        raise typer.BadParameter(
            f"{words} is not left, top, width and height, such as 60,400,120,30",
            param_hint="--box",
        ) from error
    with VideoFile(video) as film:
        size_wh = (film.info.width, film.info.height)
    box = Box(left, top, left + width, top + height)
    if (
        min(left, top) < 0
        or min(width, height) < 8
        or box.right > size_wh[0]
        or box.bottom > size_wh[1]
    ):
        raise typer.BadParameter(
            f"{words} is no part of the {size_wh[0]}x{size_wh[1]} picture of 8x8 px or more",
            param_hint="--box",
        )
    return box


def correct(
    track: Annotated[Path, typer.Argument(help="track.csv as measured.")],
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
            help="Joints as `chainage track --joints` wrote them; the rig states their spacing."
        ),
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Rig file with which the track was made; with it the height is reported too."
        ),
    ] = None,
    height_sigma_mm: Annotated[
        float,
        typer.Option(min=0, help="Uncertainty of the rig's height, one sigma; 0: its tolerance."),
    ] = 0.0,
    focal_sigma_px: Annotated[
        float,
        typer.Option(min=0, help="Uncertainty of the focal length, one sigma; 0: its tolerance."),
    ] = 0.0,
) -> None:
    """Bring a finished track to scale by known lengths and joints, without decoding again."""
    from app.survey.distances import correct_track as correction
    from vo_core import Rig

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
        console.print(table)
    print_rows(result.rows())
    if result.by_joints is not None:
        console.print(str(result.by_joints))
    console.print(f"{out}: corrected track")
