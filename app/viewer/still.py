"""The 3D view of a report as a stand-alone page."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from app.errors import NoScene
from app.reports.report import Report
from app.survey.distances.track_rows import estimate_at
from app.viewer.private_server import ViewerUnavailable
from app.viewer.scene import still_page
from app.viewer.scene_feed import defect_pin, joint_marks
from app.viewer.wall import WallPictures
from app.viewer.wording import Wording


def scene_page(report: Report) -> str:
    """Return a page with culvert, path, defects and the seen wall, as reported.

    Raises:
        NoScene: The viewer could not be started.
    """
    finishes_m = {stretch.start.id: stretch.finish.distance_m for stretch in report.stretches}
    pins = [
        replace(
            defect_pin(
                entry.id,
                entry.tag,
                entry.kind,
                report.language,
                distance_m=entry.distance_m,
                finish_m=finishes_m.get(entry.id),
                u95_m=entry.u95_m,
                source=entry.source,
                clock_h=entry.clock_h,
                lateral_m=entry.y_m or 0.0,
                figures=entry.figures,
            ),
            number=entry.number,
        )
        for entry in report.entries
        if entry.distance_m is not None
    ]
    layout, adjusted = report.layout, report.adjusted
    track = report.initial_pose.added_to(report.track)
    wall = None
    if layout is not None and adjusted is not None:
        revisions = dict.fromkeys(report.wall, 1)
        wall = WallPictures.placed(
            revisions, layout, adjusted.chainage_mm, partial(_picture, report)
        )
    try:
        return still_page(
            report.rig,
            track,
            estimate_at(track, 0),
            pins,
            joint_marks(adjusted) if adjusted else (),
            wall,
            Wording(report.language, report.units),
        )
    except ViewerUnavailable as error:
        raise NoScene(f"The 3D view could not be started: {error}") from error


def _picture(report: Report, index: int) -> bytes | None:
    try:
        return report.wall[index].read_bytes()
    except FileNotFoundError:
        return None
