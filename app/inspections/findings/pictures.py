"""Pictures of findings: the unrolled wall around each, with its outline."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass

import msgspec

from app.errors import TileNotFound
from app.inspections.observations import rig_of
from app.jobs.requests.media import CutRequest
from app.storage.records.findings import FindingStore
from app.storage.records.inspections import InspectionStore
from app.survey.findings.records import Finding
from app.tracking.pictures.media import Media
from app.tracking.unrolled import Unrolled
from vo_core.mosaic.layout import Layout

_AROUND_MM = 60.0
"""Wall on either side of a finding that its picture shows, at least."""
_AROUND = 0.3
"""The same as a share of its size."""
_LONGEST_MM = 2000.0
"""A longer one is shown around its middle."""


@dataclass(frozen=True)
class FindingPicture:
    """A picture that can be made."""

    version: str
    """Another one whenever the picture changes."""
    jpeg: Callable[[], bytes]


class FindingPictures:
    """Cuts the wall around findings."""

    def __init__(
        self, inspections: InspectionStore, store: FindingStore, unrolled: Unrolled, media: Media
    ) -> None:
        self._inspections = inspections
        self._store = store
        self._unrolled = unrolled
        self._media = media

    def of(self, inspection_id: str, finding_id: str) -> FindingPicture:
        """Return the picture of a finding.

        Raises:
            InspectionNotFound, FindingNotFound: There is none.
            TileNotFound: The wall there is not painted (any more).
        """
        finding = self._store.get(inspection_id, finding_id)
        layout = self._unrolled.layout(rig_of(self._inspections.get(inspection_id)))
        first, last = _stretch_mm(finding)
        wanted = range(int(first // layout.tile_mm), int(last // layout.tile_mm) + 1)
        tiles = {
            tile.index: tile.revision
            for tile in self._unrolled.tiles(inspection_id)
            if tile.index in wanted
        }
        if not tiles:
            raise TileNotFound("The wall around this finding is not painted.")
        cut = _cut(finding, layout, (first, last))
        shown = hashlib.sha256(msgspec.json.encode([sorted(tiles.items()), cut])).hexdigest()

        def jpeg() -> bytes:
            pictures = {index: self._unrolled.picture(inspection_id, index) for index in tiles}
            return self._media.cut(msgspec.structs.replace(cut, tiles=pictures))

        return FindingPicture(shown[:32], jpeg)


def _cut(finding: Finding, layout: Layout, stretch_mm: tuple[float, float]) -> CutRequest:
    """Return the piece of wall in pixels of the mosaic: column 0 is raw distance 0."""
    row_mm = (layout.arc_to_mm - layout.arc_from_mm) / layout.height_px
    _, low_mm, _, high_mm = finding.box_mm
    margin_mm = _margin_mm(high_mm - low_mm)
    rows = [
        min(max(round((mm - layout.arc_from_mm) / row_mm), 0), layout.height_px)
        for mm in (low_mm - margin_mm, high_mm + margin_mm)
    ]
    first, last = (round(mm / layout.mm_per_px) for mm in stretch_mm)
    return CutRequest(
        {},
        layout.width_px,
        (first, last),
        (min(rows[0], layout.height_px - 1), max(rows[1], rows[0] + 1)),
        [
            (x / layout.mm_per_px - first, (y - layout.arc_from_mm) / row_mm - rows[0])
            for x, y in finding.outline_mm
        ],
        is_closed=finding.kind != "crack",
    )


def _stretch_mm(finding: Finding) -> tuple[float, float]:
    first, _, last, _ = finding.box_mm
    if last - first > _LONGEST_MM:
        middle = finding.middle_mm[0]
        return middle - _LONGEST_MM / 2, middle + _LONGEST_MM / 2
    margin_mm = _margin_mm(last - first)
    return first - margin_mm, last + margin_mm


def _margin_mm(size_mm: float) -> float:
    return max(_AROUND_MM, _AROUND * size_mm)
