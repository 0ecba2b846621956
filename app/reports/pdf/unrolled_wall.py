"""The picture of the whole wall in strips of five metres, with its defects."""

from __future__ import annotations

import math
from dataclasses import dataclass

from reportlab.lib.colors import white
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable, PageBreak

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.placement import capacity, spread
from app.reports.content.translator import Translator
from app.reports.pdf.flow import Figure, Heading, note
from app.reports.pdf.pictures import jpeg_of
from app.reports.pdf.styles import (
    INK,
    SEVERITY,
    SOFT,
    TINY,
    WASH,
    WIDTH,
    on_severity,
)
from app.reports.pdf.text import draw
from app.reports.report import Entry, Report
from app.survey.rounding import decimals
from vo_core.mosaic.mosaic import Layout

STRIP_M = 5.0
TILE_PX = 400
"""500 mm of wall take 16 mm of paper: 600 dpi for readers who zoom in."""

_LEFT = 9 * mm
_BADGE = 4.4 * mm
_TALLEST = 110 * mm


def unrolled_wall(report: Report, t: Translator) -> list[Flowable]:
    """Build strips from the start to the end, where the wall was seen."""
    layout = report.layout
    heading = Heading(t("wall.title"))
    if not report.wall or layout is None:
        return [heading, note(t("wall.none")), PageBreak()]
    parts: list[Flowable] = [heading, note(t("wall.help"))]
    axis = Axis.of(report)
    tiles = _placed(report, layout)
    first = math.floor(min(axis.first_m, *(tile.from_m for tile in tiles)) / STRIP_M + 1e-6)
    last = math.ceil(max(axis.last_m, *(tile.to_m for tile in tiles)) / STRIP_M - 1e-6)
    for number in range(first, last):
        strip = _Strip(report, t, layout, tiles, number * STRIP_M)
        if strip.tiles or strip.entries:
            parts.append(Figure(strip.height, strip.paint))
    return [*parts, PageBreak()]


@dataclass(frozen=True)
class _Tile:
    """A tile at its corrected distance."""

    index: int
    from_m: float
    to_m: float


def _placed(report: Report, layout: Layout) -> list[_Tile]:
    def corrected_m(raw_mm: float) -> float:
        return (report.adjusted.chainage_mm(raw_mm) if report.adjusted else raw_mm) / 1000

    return [
        _Tile(k, corrected_m(k * layout.tile_mm), corrected_m((k + 1) * layout.tile_mm))
        for k in sorted(report.wall)
    ]


class _Strip:
    """Five metres of wall."""

    def __init__(
        self, report: Report, t: Translator, layout: Layout, tiles: list[_Tile], first_m: float
    ) -> None:
        self.report = report
        self.t = t
        self.layout = layout
        self.first_m = first_m
        self.last_m = first_m + STRIP_M
        self.scale = (WIDTH - _LEFT) / STRIP_M
        self.tiles = [tile for tile in tiles if tile.to_m > first_m and tile.from_m < self.last_m]
        self.entries = [
            entry
            for entry in report.entries
            if entry.distance_m is not None and first_m <= entry.distance_m < self.last_m
        ]
        arc_m = (layout.arc_to_mm - layout.arc_from_mm) / 1000
        self.wall = min(arc_m * self.scale, _TALLEST)
        self.rows = max(1, math.ceil(len(self.entries) / capacity(_BADGE, 0, WIDTH - _LEFT)))
        self.bottom = 8 * mm

    @property
    def height(self) -> float:
        """Height including the numbers above and the distances below."""
        return self.bottom + self.wall + self.rows * _BADGE + 6 * mm

    def x_of(self, distance_m: float) -> float:
        """Return the position along the page."""
        return _LEFT + (distance_m - self.first_m) * self.scale

    def y_of(self, arc_mm: float) -> float:
        """Return the vertical position: left of the camera above, right of it below, like the
        tiles.
        """
        low, high = self.layout.arc_from_mm, self.layout.arc_to_mm
        return self.bottom + self.wall * (high - arc_mm) / (high - low)

    def paint(self, canvas: Canvas) -> None:
        """Draw the strip."""
        canvas.setFillColor(WASH)
        canvas.rect(_LEFT, self.bottom, WIDTH - _LEFT, self.wall, 0, 1)
        self._tiles(canvas)
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.6)
        canvas.rect(_LEFT, self.bottom, WIDTH - _LEFT, self.wall, 1, 0)
        self._clock(canvas)
        self._distances(canvas)
        self._joints(canvas)
        self._stretches(canvas)
        self._entries(canvas)

    def _tiles(self, canvas: Canvas) -> None:
        canvas.saveState()
        frame = canvas.beginPath()
        frame.rect(_LEFT, self.bottom, WIDTH - _LEFT, self.wall)
        canvas.clipPath(frame, 0, 0)
        for tile in self.tiles:
            picture = jpeg_of(self.report.wall[tile.index], TILE_PX)
            if picture is not None:
                x = self.x_of(tile.from_m)
                canvas.drawImage(picture, x, self.bottom, self.x_of(tile.to_m) - x, self.wall)
        canvas.restoreState()

    def _clock(self, canvas: Canvas) -> None:
        """Draw hours at the left edge; millimetres from the middle on a flat floor."""
        diameter_mm = self.report.rig.pipe.diameter_mm
        if diameter_mm is None:
            places = [(f"{arc:+g}" if arc else "0", float(arc)) for arc in (-100, 0, 100)]
        else:
            hour_mm = math.pi * diameter_mm / 12
            places = [(str((6 - n) % 12 or 12), n * hour_mm) for n in range(-6, 7)]
        last_y = math.inf
        for name, arc_mm in places:
            if self.layout.arc_from_mm <= arc_mm <= self.layout.arc_to_mm:
                y = self.y_of(arc_mm)
                canvas.setStrokeColor(INK)
                canvas.setLineWidth(0.4)
                canvas.line(_LEFT - 1.2 * mm, y, _LEFT, y)
                if last_y - y >= 2.2 * mm:
                    draw(canvas, _LEFT - 1.8 * mm, y - 0.7 * mm, name, TINY.soft(), "right")
                    last_y = y

    def _distances(self, canvas: Canvas) -> None:
        step_m = tick_step_m(self.t, self.scale, 15 * mm)
        for distance_m in Axis(self.first_m, self.last_m).ticks(step_m):
            x = self.x_of(distance_m)
            canvas.setStrokeColor(INK)
            canvas.setLineWidth(0.4)
            canvas.line(x, self.bottom, x, self.bottom - 1.3 * mm)
            is_edge = x > WIDTH - 4 * mm
            text = f"{decimals(distance_m, 1, unit=self.t.per_unit_m)} {self.t.units}"
            draw(canvas, x, self.bottom - 3.8 * mm, text, TINY.soft(),
                 "right" if is_edge else "centre")  # fmt: skip

    def _joints(self, canvas: Canvas) -> None:
        for joint in self.report.joints:
            x = self.x_of(joint.distance_mm / 1000)
            if _LEFT <= x <= WIDTH:
                canvas.setStrokeColor(SOFT)
                canvas.setLineWidth(0.5)
                canvas.line(x, self.bottom - 4.4 * mm, x, self.bottom - 6 * mm)
                if joint.number is not None:
                    draw(canvas, x + 0.6 * mm, self.bottom - 6.4 * mm, f"J{joint.number}",
                         TINY.soft())  # fmt: skip

    def _stretches(self, canvas: Canvas) -> None:
        for stretch in self.report.stretches:
            start_m, finish_m = stretch.start.distance_m, stretch.finish.distance_m
            if start_m is None or finish_m is None:
                continue
            low, high = max(start_m, self.first_m), min(finish_m, self.last_m)
            if low < high:
                canvas.setStrokeColor(INK)
                canvas.setLineWidth(1.6)
                y = self.bottom + self.wall + 1 * mm
                canvas.line(self.x_of(low), y, self.x_of(high), y)

    def _entries(self, canvas: Canvas) -> None:
        for row in range(self.rows):
            entries = self.entries[row :: self.rows]
            wanted = [self.x_of(entry.distance_m or 0.0) for entry in entries]
            places = spread(wanted, _BADGE, _LEFT, WIDTH)
            y = self.bottom + self.wall + 2.6 * mm + row * _BADGE
            for entry, x in zip(entries, places, strict=True):
                self._mark(canvas, entry, x, y)

    def _mark(self, canvas: Canvas, entry: Entry, badge_x: float, badge_y: float) -> None:
        x = self.x_of(entry.distance_m or 0.0)
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.5)
        canvas.line(badge_x, badge_y, x, self.bottom + self.wall)
        arc_mm = self._arc_mm(entry)
        if arc_mm is not None and self.layout.arc_from_mm <= arc_mm <= self.layout.arc_to_mm:
            y = self.y_of(arc_mm)
            for colour, width in ((white, 1.8), (INK, 0.8)):
                canvas.setStrokeColor(colour)
                canvas.setLineWidth(width)
                canvas.line(x, self.bottom + self.wall, x, y + 1.8 * mm)
                canvas.rect(x - 1.8 * mm, y - 1.8 * mm, 3.6 * mm, 3.6 * mm, 1, 0)
        else:
            canvas.setDash(1.5, 1)
            canvas.line(x, self.bottom + self.wall, x, self.bottom)
            canvas.setDash()
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.4)
        canvas.setFillColor(SEVERITY.get(entry.tag.severity or 0, WASH))
        canvas.circle(badge_x, badge_y + 1.5 * mm, 1.9 * mm, 1, 1)
        style = TINY.bold().on(on_severity(entry.tag.severity))
        draw(canvas, badge_x, badge_y + 0.8 * mm, str(entry.seq), style, "centre")

    def _arc_mm(self, entry: Entry) -> float | None:
        """Return the position around the wall, from the invert to the right."""
        diameter_mm = self.report.rig.pipe.diameter_mm
        if diameter_mm is None:
            return None if entry.y_m is None else 1000 * entry.y_m
        if entry.y_m is not None and entry.z_m is not None:
            return diameter_mm / 2 * math.atan2(entry.y_m, entry.z_m)
        if entry.clock_from is None:
            return None
        hours = (6 - entry.clock_from) % 12
        return math.pi * diameter_mm / 12 * (hours - 12 if hours > 6 else hours)
