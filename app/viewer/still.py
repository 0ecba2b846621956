"""The 3D view of a report as a stand-alone page."""

from __future__ import annotations

from app.errors import NoScene
from app.reports.report import Entry, Report
from app.survey.track_rows import estimate_at
from app.viewer.scene import Pin, ViewerUnavailable, WallLayout, WallTile, Wording, still_page
from app.viewer.scene_feed import joint_marks


def scene_page(report: Report) -> str:
    """Return a page with culvert, path, defects and the seen wall, as reported.

    Raises:
        NoScene: The viewer could not be started.
    """
    finishes = {stretch.start.id: stretch.finish for stretch in report.stretches}
    pins = [_pin(entry, finishes.get(entry.id), report) for entry in report.entries]
    layout, adjusted = report.layout, report.adjusted
    tiles: list[WallTile] = []
    shape = None
    if layout is not None and adjusted is not None:
        shape = WallLayout(
            layout.arc_from_mm / 1000, layout.arc_to_mm / 1000, layout.width_px, layout.height_px
        )
        ends_m = {n: adjusted.chainage_mm(n * layout.tile_mm) / 1000 for n in _ends(report)}
        tiles = [WallTile(n, 1, ends_m[n], ends_m[n + 1]) for n in report.wall]

    def read(index: int) -> bytes | None:
        try:
            return report.wall[index].read_bytes()
        except FileNotFoundError:
            return None

    try:
        return still_page(
            report.rig,
            report.track,
            estimate_at(report.track, 0),
            [pin for pin in pins if pin is not None],
            joint_marks(adjusted) if adjusted else (),
            tiles,
            shape,
            read,
            Wording(report.language, report.units),
        )
    except ViewerUnavailable as error:
        raise NoScene(f"The 3D view could not be started: {error}") from error


def _ends(report: Report) -> set[int]:
    """Return the indices of the borders between tiles."""
    return {*report.wall, *(index + 1 for index in report.wall)}


def _pin(entry: Entry, finish: Entry | None, report: Report) -> Pin | None:
    if entry.distance_m is None:
        return None
    code = " ".join(part for part in (entry.tag.code, entry.tag.char1, entry.tag.char2) if part)
    label = entry.label(report.language)
    return Pin(
        id=entry.id,
        distance_m=entry.distance_m,
        clock=entry.clock_from,
        u95_m=entry.u95_m,
        severity=entry.tag.severity,
        label=f"{code} {label.partition(':')[0]}" if label else code or "?",
        lateral_m=entry.y_m or 0.0,
        clock_to=entry.tag.clock_to if entry.clock_from is not None else None,
        finish_m=finish.distance_m if finish else None,
    )
