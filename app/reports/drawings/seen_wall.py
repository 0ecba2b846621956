"""The unrolled wall as reports draw it: what was seen, where joints and observations lie on it."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.reports.content.translator import Translator
from app.reports.drawings.cut_pipe import clock_spans
from app.reports.report import Entry, Report
from app.storage.blobs.blobs import Readable
from app.survey.places.spans import SAME_M, Span, begins_within, is_within, overlap
from vo_core.geometry.measure import developed_points
from vo_core.mosaic.layout import UNSEEN_GREY, Layout

_SMALL = 8
"""Tiles are looked at in an eighth of their size, which a JPEG decoder makes cheaply."""
_GREY_TOLERANCE = 4
"""JPEG shifts the even grey of unseen places by less."""
_SEEN_SHARE = 0.1
"""A column of a tile counts as seen from this share of its height on."""
_ROW_SHARE = 0.02
"""The drawing is as high as the part of the wall of which this share of the length was seen."""
_SHORTEST_GAP_M = 0.02


@dataclass(frozen=True)
class SeenTile:
    """A tile of the mosaic at its corrected distance."""

    jpeg: Readable
    size: int
    """Bytes of the file."""
    span_m: Span
    seen_m: Span | None
    """The part from the first to the last seen column; None if nothing was seen."""


@dataclass(frozen=True)
class Wall:
    """The part of the wall that was seen."""

    tiles: tuple[SeenTile, ...]
    """Pictures of the wall in the order of their distances, without those that show nothing."""
    span_m: Span
    arc_mm: Span
    """The seen part around the wall; 0 at the invert or the middle of a floor, to the right."""
    layout: Layout

    def gaps(self, span_m: Span) -> list[Span]:
        """Return the parts of a span inside the wall that were not seen."""
        first_m, last_m = max(span_m[0], self.span_m[0]), min(span_m[1], self.span_m[1])
        found, at_m = [], first_m
        for tile in self.tiles:
            if tile.seen_m is None or tile.seen_m[1] <= at_m:
                continue
            if tile.seen_m[0] >= last_m:
                break
            found.append((at_m, tile.seen_m[0]))
            at_m = tile.seen_m[1]
        found.append((at_m, last_m))
        return [(low, high) for low, high in found if high - low >= _SHORTEST_GAP_M]

    def within(self, span_m: Span) -> list[SeenTile]:
        """Return the tiles that overlap a span."""
        return [tile for tile in self.tiles if overlap(tile.span_m, span_m)]


@dataclass(frozen=True)
class Place:
    """Where an observation lies on the wall."""

    along_m: Span
    around_mm: tuple[Span, ...]
    """Two spans where a sector goes across the crown, at which the wall is cut."""
    outlines: tuple[tuple[tuple[float, float], ...], ...] = ()
    """What was measured: points along, m, and around the wall, mm."""


@dataclass(frozen=True)
class DrawnJoint:
    """A joint in a drawing."""

    distance_m: float
    number: int | None
    is_seen: bool
    """Else it is expected there."""


def joints_within(report: Report, span_m: Span) -> list[DrawnJoint]:
    """Return the joints of a span, the seen ones first."""
    seen = [DrawnJoint(joint.distance_mm / 1000, joint.number, True) for joint in report.joints]
    expected = [
        DrawnJoint(joint.distance_mm / 1000, None, False) for joint in report.expected_joints
    ]
    return [joint for joint in (*seen, *expected) if is_within(joint.distance_m, span_m)]


def stretches_within(report: Report, span_m: Span) -> list[tuple[int, Span]]:
    """Return number and ends of the stretches that reach into a span."""
    return [
        (stretch.number, (start_m, finish_m))
        for stretch in report.stretches
        if (start_m := stretch.start.distance_m) is not None
        and (finish_m := stretch.finish.distance_m) is not None
        and overlap((start_m, finish_m), span_m)
    ]


def places_within(report: Report, wall: Wall, span_m: Span) -> list[tuple[Entry, Place]]:
    """Return the observations of a span that begins where another ends, each with its place."""
    is_inside = is_within if span_m[1] >= wall.span_m[1] - SAME_M else begins_within
    return [
        (entry, place)
        for entry in report.entries
        if entry.distance_m is not None
        and is_inside(entry.distance_m, span_m)
        and (place := place_of(report, entry)) is not None
    ]


def remarks_on(report: Report, wall: Wall, t: Translator) -> list[str]:
    """Return what a reader of the drawing should know of gaps and of what is outside it."""
    remarks = [t("wall.gaps")] if wall.gaps(wall.span_m) else []
    inside = {entry.id for entry, _ in places_within(report, wall, wall.span_m)}
    outside = [
        str(entry.number)
        for entry in report.entries
        if entry.distance_m is not None and entry.id not in inside
    ]
    if outside:
        remarks.append(t("wall.outside", numbers=", ".join(outside)))
    return remarks


def tick_digits(t: Translator, step_m: float) -> int:
    """Return the decimals that show a round step."""
    return max(0, -math.floor(math.log10(step_m / t.per_unit_m) + 1e-9))


def wall_of(report: Report) -> Wall | None:
    """Look at the tiles of a report; None if nothing of the wall was seen."""
    layout = report.layout
    if layout is None:
        return None
    tiles, seen_rows = [], np.zeros(0)
    for index in sorted(report.wall):
        looked = _looked_at(report.wall[index])
        if looked is None:
            continue
        size, seen = looked
        low_m, high_m = (_corrected_m(report, n * layout.tile_mm) for n in (index, index + 1))
        columns = np.flatnonzero(seen.mean(axis=0) >= _SEEN_SHARE)
        seen_m = None
        if len(columns):
            first, last = (float(n) / seen.shape[1] for n in (columns[0], columns[-1] + 1))
            seen_m = (low_m + first * (high_m - low_m), low_m + last * (high_m - low_m))
        tiles.append(SeenTile(report.wall[index], size, (low_m, high_m), seen_m))
        rows = seen.mean(axis=1)
        seen_rows = rows if not len(seen_rows) else seen_rows + _fitted(rows, len(seen_rows))
    spans = [tile.seen_m for tile in tiles if tile.seen_m is not None]
    rows_seen = np.flatnonzero(seen_rows >= _ROW_SHARE * max(len(spans), 1))
    if not spans or not len(rows_seen):
        return None
    per_row_mm = (layout.arc_to_mm - layout.arc_from_mm) / len(seen_rows)
    arc_mm = (
        layout.arc_from_mm + float(rows_seen[0]) * per_row_mm,
        layout.arc_from_mm + float(rows_seen[-1] + 1) * per_row_mm,
    )
    span_m = (min(low for low, _ in spans), max(high for _, high in spans))
    return Wall(tuple(tiles), span_m, arc_mm, layout)


def _looked_at(jpeg: Readable) -> tuple[int, NDArray[np.bool_]] | None:
    """Return size in bytes and the seen pixels of a small copy; None if it cannot be read."""
    try:
        content = jpeg.read_bytes()
        with Image.open(io.BytesIO(content)) as picture:
            picture.draft("RGB", (picture.width // _SMALL, picture.height // _SMALL))
            pixels = np.asarray(picture.convert("RGB"), np.int16)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    seen = np.any(abs(pixels - UNSEEN_GREY) > _GREY_TOLERANCE, axis=2)
    return len(content), np.asarray(seen)


def _fitted(rows: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return as many rows; tiles of another layout may be a row higher or lower."""
    return np.interp(np.linspace(0, 1, count), np.linspace(0, 1, len(rows)), rows)


def _corrected_m(report: Report, raw_mm: float) -> float:
    return (report.adjusted.chainage_mm(raw_mm) if report.adjusted else raw_mm) / 1000


def place_of(report: Report, entry: Entry) -> Place | None:
    """Return where an observation lies; without a clock position `around_mm` is empty, without a
    distance there is no place.
    """
    if entry.distance_m is None:
        return None
    drawn = [
        developed_points(np.array(figure.points_mm), report.rig.pipe.radius_mm)
        for figure in entry.figures
        if figure is not None and len(figure.points_mm) > 1
    ]
    outlines = tuple(tuple((x / 1000, arc) for x, arc in line.tolist()) for line in drawn)
    points = [point for line in outlines for point in line]
    along_m = [entry.distance_m, *(x_m for x_m, _ in points)]
    spans = _sector_mm(report, entry)
    if not spans and points:
        arcs = [arc for _, arc in points]
        spans = [(min(arcs), max(arcs))]
    return Place((min(along_m), max(along_m)), tuple(spans), outlines)


def clock_places(report: Report, *, feet: bool) -> list[tuple[str, float]]:
    """Return the hours with their arcs, mm; on a flat floor the distances from its middle.

    Args:
        report: The report.
        feet: Name the distances on a floor in feet.
    """
    radius_mm = report.rig.pipe.radius_mm
    if radius_mm is not None:
        hour_mm = math.pi * radius_mm / 6
        return [(str((6 - n) % 12 or 12), n * hour_mm) for n in range(-6, 7)]
    unit_mm, step = (304.8, 0.5) if feet else (1000.0, 0.1)
    return [(f"{n * step:+.1f}" if n else "0", n * step * unit_mm) for n in range(-50, 51)]


def _sector_mm(report: Report, entry: Entry) -> list[Span]:
    """Return the arcs of its clock position or sector; a point on the wall is known exactly."""
    radius_mm = report.rig.pipe.radius_mm
    if radius_mm is None:
        return [] if entry.y_m is None else [(1000 * entry.y_m, 1000 * entry.y_m)]
    around_mm = 2 * math.pi * radius_mm
    spans = clock_spans(entry.clock_from, entry.tag.clock_to)
    is_sector = any(low < high for low, high in spans)
    if not is_sector and entry.y_m is not None and entry.z_m is not None:
        share = 0.5 + math.atan2(entry.y_m, entry.z_m) / (2 * math.pi)
        spans = [(share, share)]
    return [((low - 0.5) * around_mm, (high - 0.5) * around_mm) for low, high in spans]
