"""Charts of the quality of the measurement over the distance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable

from app.reports.content.axis import Axis, tick_step_m
from app.reports.content.translator import Translator
from app.reports.pdf.flow import Figure, Heading, note
from app.reports.pdf.styles import INK, RULE, SOFT, TINY, WASH, WIDTH
from app.reports.pdf.text import draw
from app.reports.report import Report
from app.survey.interval import U95
from vo_core.image.health import complained

_BINS = 300
_LEFT = 26 * mm


def along(report: Report, t: Translator) -> list[Flowable]:
    """Build charts over the distance, where there is a track."""
    if not len(report.track):
        return []
    heard = _complained(report)
    height = (46 + 4.4 * len(heard)) * mm
    return [
        CondPageBreak(height + 22 * mm),  # heading, charts and note stay together
        Heading(t("measurement.along"), level=1, bookmark=False),
        Figure(
            height,
            lambda canvas: _Chart(report, t, heard).paint(canvas, height),
            alt=t("alt.along", half=f"{t.half_width(_widest_m(report))} {t.units}"),
        ),
        note(t("measurement.along_help")),
    ]


def _widest_m(report: Report) -> float:
    return float(U95 * np.nanmax(report.track.sigma_distance_mm) / 1000)


def _complained(report: Report) -> dict[str, NDArray[np.bool_]]:
    """Return the frames of each complaint that occurs."""
    rows = len(report.track)
    found = {}
    for name, frames in complained(report.health).items():
        found[name] = np.zeros(rows, bool)
        found[name][: len(frames)] = frames[:rows]
    return {name: frames for name, frames in found.items() if frames.any()}


class _Chart:
    """Quality, half-width and complaints over the distance: the worst value at each place."""

    def __init__(self, report: Report, t: Translator, heard: dict[str, NDArray[np.bool_]]) -> None:
        track = report.track
        self.t = t
        self.axis = Axis.of(report)
        self.heard = heard
        share = (track.distance_mm / 1000 - self.axis.first_m) / self.axis.length_m
        self.bins = np.clip((share * _BINS).astype(int), 0, _BINS - 1)
        self.quality = self._binned(track.quality, np.minimum, np.inf)
        half_m = U95 * track.sigma_distance_mm / 1000
        self.half_m = self._binned(half_m, np.maximum, -np.inf)
        self.weak = self._seen(track.status == "weak")
        self.lost = self._seen(track.status == "lost")
        self.scale = (WIDTH - _LEFT) / self.axis.length_m

    def _binned(
        self, values: NDArray[np.float64], take: np.ufunc, empty: float
    ) -> NDArray[np.float64]:
        found = np.full(_BINS, empty)
        take.at(found, self.bins, values)
        return np.where(np.isfinite(found), found, np.nan)

    def _seen(self, frames: NDArray[np.bool_]) -> NDArray[np.bool_]:
        found = np.zeros(_BINS, bool)
        found[self.bins[frames]] = True
        return found

    def paint(self, canvas: Canvas, height: float) -> None:
        """Draw the charts from the top down."""
        y = height - 16 * mm
        self._curve(canvas, y, 12 * mm, self.quality, 1.0, "1", self.t("measurement.quality"))
        y -= 16 * mm
        most_m = float(np.nanmax(self.half_m)) or 0.01
        top = f"{self.t.half_width(most_m)} {self.t.units}"
        self._curve(canvas, y, 12 * mm, self.half_m, most_m, top, self.t("measurement.half"))
        y -= 4.4 * mm
        lanes = [(self.t("measurement.weak"), self.weak, SOFT),
                 (self.t("measurement.lost"), self.lost, INK)]  # fmt: skip
        lanes += [
            (self.t(f"complaint.{name}"), self._seen(frames), SOFT)
            for name, frames in self.heard.items()
        ]
        for name, seen, colour in lanes:
            canvas.setFillColor(WASH)
            canvas.rect(_LEFT, y, WIDTH - _LEFT, 2.6 * mm, 0, 1)
            draw(canvas, 0, y + 0.4 * mm, name, TINY.soft())
            canvas.setFillColor(colour)
            for start, end in _spans(seen):
                x = _LEFT + (WIDTH - _LEFT) * start / _BINS
                canvas.rect(x, y, (WIDTH - _LEFT) * (end - start) / _BINS, 2.6 * mm, 0, 1)
            y -= 4.4 * mm if name != lanes[-1][0] else 0
        self._distances(canvas, y)

    def _curve(
        self,
        canvas: Canvas,
        y: float,
        height: float,
        values: NDArray[np.float64],
        most: float,
        top: str,
        name: str,
    ) -> None:
        canvas.setFillColor(WASH)
        canvas.rect(_LEFT, y, WIDTH - _LEFT, height, 0, 1)
        draw(canvas, 0, y + height / 2 - 0.7 * mm, name, TINY.soft())
        draw(canvas, _LEFT - 1 * mm, y + height - 1.5 * mm, top, TINY.soft(), "right")
        draw(canvas, _LEFT - 1 * mm, y, "0", TINY.soft(), "right")
        canvas.setStrokeColor(INK)
        canvas.setLineWidth(0.7)
        path = canvas.beginPath()
        is_down = False
        for n, value in enumerate(values):
            if np.isnan(value):
                continue
            x = _LEFT + (WIDTH - _LEFT) * (n + 0.5) / _BINS
            point = x, y + height * min(1.0, float(value) / most)
            (path.lineTo if is_down else path.moveTo)(*point)
            is_down = True
        canvas.drawPath(path, 1, 0)

    def _distances(self, canvas: Canvas, y: float) -> None:
        step_m = tick_step_m(self.t, self.scale, 14 * mm)
        for distance_m in self.axis.ticks(step_m):
            x = _LEFT + (distance_m - self.axis.first_m) * self.scale
            canvas.setStrokeColor(RULE)
            canvas.setLineWidth(0.4)
            canvas.line(x, y - 0.5 * mm, x, y - 1.6 * mm)
            text = f"{distance_m / self.t.per_unit_m:g} {self.t.units}"
            is_edge = x > WIDTH - 3 * mm
            draw(canvas, x, y - 4 * mm, text, TINY.soft(), "right" if is_edge else "centre")


def _spans(seen: NDArray[np.bool_]) -> Sequence[tuple[int, int]]:
    """Return first and last index plus one of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], seen, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
