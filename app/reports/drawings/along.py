"""Charts along the run: quality, half-width of the interval and complaints over the distance."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from app.reports.content.translator import Translator
from app.reports.drawings import svg
from app.reports.drawings.axis import Axis, tick_step_m
from app.reports.drawings.svg import Drawing
from app.reports.report import Report
from app.survey.distances.interval import U95
from vo_core.image.health import complained

_BINS = 300
_LEFT = 26.0
_CURVE, _LANE = 12.0, 2.6
_BETWEEN = 4.0


def along_the_run(report: Report, t: Translator) -> Drawing | None:
    """Draw the charts, each with the worst value at a place; None without a track."""
    if not len(report.track):
        return None
    return _Charts(report, t).drawing()


class _Charts:
    def __init__(self, report: Report, t: Translator) -> None:
        self.report = report
        self.t = t
        self.axis = Axis.of(report)
        distance_m = report.track.distance_mm / 1000
        share = (distance_m - self.axis.first_m) / self.axis.length_m
        self.bins = np.clip((share * _BINS).astype(int), 0, _BINS - 1)
        self.per_bin = (svg.WIDTH - _LEFT) / _BINS

    def drawing(self) -> Drawing:
        """Draw everything from the top down."""
        t, track = self.t, self.report.track
        half_m = U95 * track.sigma_distance_mm / 1000
        most_m = float(np.nanmax(half_m)) or 0.01
        most = f"{t.half_width(most_m)} {t.units}"
        shapes = [
            *self._curve(0, track.quality, np.fmin, (1.0, "1"), t("measurement.quality")),
            *self._curve(_CURVE + _BETWEEN, half_m, np.fmax, (most_m, most),
                         t("measurement.half")),
        ]  # fmt: skip
        y = 2 * (_CURVE + _BETWEEN)
        for name, frames, colour in self._lanes():
            shapes += self._lane(y, name, frames, colour)
            y += _LANE + 1.8
        shapes += self._distances(y - 1.8)
        return Drawing(svg.WIDTH, y + 3.4, t("alt.along", half=most), shapes)

    def _lanes(self) -> Iterator[tuple[str, NDArray[np.bool_], str]]:
        """Yield what is said of frames, where it holds, and its colour."""
        status = self.report.track.status
        yield self.t("measurement.weak"), status == "weak", svg.SOFT
        yield self.t("measurement.lost"), status == "lost", svg.INK
        for name, found in complained(self.report.health).items():
            frames = np.zeros(len(status), bool)
            frames[: len(found)] = found[: len(status)]
            if frames.any():
                yield self.t(f"complaint.{name}"), frames, svg.SOFT

    def _curve(
        self,
        y: float,
        values: NDArray[np.float64],
        worst: np.ufunc,
        most: tuple[float, str],
        name: str,
    ) -> Iterator[str]:
        """Draw a curve from zero to the most, which is a value with its name."""
        found = np.full(_BINS, np.nan)
        worst.at(found, self.bins, values)
        points = [
            (_LEFT + (n + 0.5) * self.per_bin, y + _CURVE * (1 - min(1.0, value / most[0])))
            for n, value in enumerate(found.tolist())
            if not np.isnan(value)
        ]
        yield svg.rect(_LEFT, y, svg.WIDTH - _LEFT, _CURVE, svg.WASH)
        yield svg.text(0, y + _CURVE / 2 + 0.7, name, svg.TINY, svg.SOFT)
        yield svg.text(_LEFT - 1, y + 1.5, most[1], svg.TINY, svg.SOFT, anchor="end")
        yield svg.text(_LEFT - 1, y + _CURVE, "0", svg.TINY, svg.SOFT, anchor="end")
        yield svg.path(points, svg.INK, 0.25)

    def _lane(self, y: float, name: str, frames: NDArray[np.bool_], colour: str) -> Iterator[str]:
        found = np.zeros(_BINS + 2, bool)
        found[self.bins[frames] + 1] = True
        yield svg.rect(_LEFT, y, svg.WIDTH - _LEFT, _LANE, svg.WASH)
        yield svg.text(0, y + 2.2, name, svg.TINY, svg.SOFT)
        edges = np.flatnonzero(np.diff(found.astype(int))).tolist()
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            left = _LEFT + start * self.per_bin
            yield svg.rect(left, y, (end - start) * self.per_bin, _LANE, colour)

    def _distances(self, y: float) -> Iterator[str]:
        per_m = (svg.WIDTH - _LEFT) / self.axis.length_m
        for distance_m in self.axis.ticks(tick_step_m(self.t, per_m, 14)):
            x = _LEFT + (distance_m - self.axis.first_m) * per_m
            said = f"{self.t.figure(distance_m / self.t.per_unit_m)} {self.t.units}"
            anchor = "end" if x > svg.WIDTH - 3 else "middle"
            yield svg.line((x, y + 0.5), (x, y + 1.6), svg.RULE)
            yield svg.text(x, y + 4, said, svg.TINY, svg.SOFT, anchor=anchor)
