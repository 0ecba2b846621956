"""Keeps the index of the search: an inspection that changed is derived again, as a whole.

Only the rows themselves show what is to be done: each says from which state of its
inspection it was made. So nothing is lost when the server ends.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from datetime import date, datetime
from typing import Any

from app.errors import InspectionNotFound
from app.inspections.corrections import Corrections
from app.inspections.observations import Observations
from app.inspections.packs import Packs
from app.storage.database.tables import (
    ENDED,
    LONGEST_NAME,
    IndexedDefect,
    IndexedInspection,
    Inspection,
)
from app.storage.index.defect_index import STATED, DefectIndex, Token
from app.storage.records.assets import AssetStore
from app.storage.records.assets import asset_of as registered_asset
from app.storage.records.inspections import InspectionStore
from app.survey.assets.box import box_around
from app.survey.assets.register import Line, one_line
from app.survey.catalogue.table import CodeTable
from app.survey.distances.film_quality import quality_of
from app.survey.distances.interval import half_width_m
from app.survey.fields.header import asset_of, number_of, project_of
from app.survey.folding import folded, storable
from app.survey.places.alignment import Alignment, alignment_of
from app.survey.places.clock_hours import hour_bits
from app.survey.places.place import ObservationView
from app.survey.rounding import metres
from app.tracking.live import DistancesCorrected, Event, ObservationsChanged, Update
from app.tracking.tracks import Tracks
from app.tracking.worker import HINDRANCES, Worker

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0
_LOOK_EVERY_S = 30.0
"""Longest time until a change is noticed that no event has announced."""
_LEAST_PAUSE_S = 0.01
_AT_ONCE = 1000
"""Stale inspections that are read at a time."""


class Indexer:
    """Derives what the index holds of an inspection, and stores it."""

    def __init__(
        self,
        index: DefectIndex,
        inspections: InspectionStore,
        observations: Observations,
        corrections: Corrections,
        tracks: Tracks,
        packs: Packs,
        register: AssetStore,
    ) -> None:
        self._index = index
        self._inspections = inspections
        self._observations = observations
        self._corrections = corrections
        self._tracks = tracks
        self._packs = packs
        self._register = register
        self._failed: dict[str, Token] = {}
        """Inspections that could not be derived, and in which state."""

    def index_next(self) -> Iterator[str]:
        """Index all inspections that are not in the index as they are; yield the id of each.

        Raises:
            Busy, DiskFull: The database accepts nothing now.
            StoreUnavailable: The tracks cannot be read now.
        """
        while due := self._due():
            for inspection_id, token in due.items():
                try:
                    self.index(inspection_id)
                except InspectionNotFound:  # deleted meanwhile
                    continue
                except HINDRANCES:
                    raise
                except Exception:
                    # One damaged inspection must not keep the others out of the search.
                    logger.exception("Inspection %s could not be indexed.", inspection_id)
                    self._failed[inspection_id] = token
                yield inspection_id

    def _due(self) -> dict[str, Token]:
        """Return some of the stale inspections, without those that failed in this very state."""
        stale = self._index.stale(_AT_ONCE + len(self._failed))
        return {one: token for one, token in stale.items() if self._failed.get(one) != token}

    def index(self, inspection_id: str) -> None:
        """Derive an inspection and replace what is indexed of it.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        token = self._index.token(inspection_id)
        row = self._inspections.get(inspection_id)
        if token is None:
            return
        views = self._observations.all(inspection_id)
        table = self._packs.table_of(row.header)
        end = self._corrections.end(row) or (None, None)
        registered = self._line_of(row.header)
        surveyed_m = None if end[0] is None else metres(end[0])
        course = alignment_of(row.header, registered, surveyed_m)
        indexed = self._indexed(row, end, _line(row.header, registered, course))
        self._index.put(token, indexed, [_defect(view, table, course) for view in views])

    def _line_of(self, header: Mapping[str, Any]) -> Line:
        asset_id = asset_of(header)
        row = self._register.find(one_line(asset_id)) if asset_id else None
        return registered_asset(row).line if row else ()

    def _indexed(
        self,
        row: Inspection,
        end: tuple[float | None, float | None],
        line: list[list[float]],
    ) -> IndexedInspection:
        distance_mm, sigma_mm = end
        quality = quality_of(self._tracks.get(row.id), self._tracks.health(row.id).columns())
        return IndexedInspection(
            inspection_id=row.id,
            name=storable(row.name),
            project=_named(project_of(row.header)),
            asset=_named(asset_of(row.header)),
            surveyed_on=surveyed_on(row.header, row.created_at),
            distance_m=None if distance_mm is None else metres(distance_mm),
            distance_u95_m=None if sigma_mm is None else half_width_m(sigma_mm),
            **{} if quality is None else vars(quality),
            **_position(row.header, "start"),
            **_position(row.header, "end"),
            line=line or None,
            **box_around(line),
        )


def _line(
    header: Mapping[str, Any], registered: Line, course: Alignment | None
) -> list[list[float]]:
    """Return the course; without its length the line of the register, else the stated ends."""
    if course is not None:
        return [list(point) for point in course.part(0.0, course.length_m)]
    if registered:
        return [list(point) for point in registered]
    stated = {**_position(header, "start"), **_position(header, "end")}
    ends = ("start", "end")
    return [[stated[f"{end}_lon"], stated[f"{end}_lat"]] for end in ends if f"{end}_lon" in stated]


def _position(header: Mapping[str, Any], end: str) -> dict[str, float]:
    """Return where one end is by the header; nothing unless both numbers are degrees."""
    lat, lon = (number_of(header.get(f"{end}_{name}")) for name in ("lat", "lon"))
    if lat is None or lon is None or abs(lat) > 90 or abs(lon) > 180:
        return {}
    return {f"{end}_lat": lat, f"{end}_lon": lon}


def surveyed_on(header: Mapping[str, Any], created_at: datetime) -> date:
    """Return the day of a survey: of the header, else the day when the inspection was made."""
    try:
        return date.fromisoformat(str(header.get("date")))
    except ValueError:
        return created_at.date()


def _defect(view: ObservationView, table: CodeTable, course: Alignment | None) -> IndexedDefect:
    row, tag, place = view.row, view.row.tag, view.place
    kind = table.named(tag.code, tag.char1, tag.char2)
    stated = {name: getattr(tag, name) for name in STATED}
    derived: dict[str, Any] = {
        "observation_id": row.id,
        "seq": row.seq,
        "created_at": row.created_at,
        "label": kind.label if kind else None,
        "label_ms": kind.label_ms if kind else None,
        "unit1": kind.unit_q1 if kind and tag.quant1 is not None else None,
        "unit2": kind.unit_q2 if kind and tag.quant2 is not None else None,
        "distance_m": metres(place.distance_mm) if place else None,
        "distance_u95_m": place.u95_m if place else None,
        "clock": view.clock,
        "clock_hours": hour_bits(view.clock, tag.clock_to),
        "remark": None if tag.remark is None else storable(tag.remark),
    }
    if course is not None and derived["distance_m"] is not None:
        derived["lon"], derived["lat"] = course.at(derived["distance_m"])
    labels = (kind.label, *kind.labels.values()) if kind else ()
    return IndexedDefect(folded=folded(derived["remark"], tag.code, *labels), **stated | derived)


def _named(text: str | None) -> str | None:
    """Return a name that a database can index: PostgreSQL refuses more than some 2,700 bytes."""
    return None if text is None else storable(text)[:LONGEST_NAME]


class IndexWorker(Worker):
    """A thread that indexes what has changed, at most half of the time."""

    def __init__(self, indexer: Indexer, on_indexed: Callable[[], None]) -> None:
        """Call `on_indexed` after each inspection."""
        super().__init__("search-index", stop_timeout_s=_STOP_TIMEOUT_S)
        self._indexer = indexer
        self._on_indexed = on_indexed

    def on_event(self, event: Event) -> None:
        """Handle an event."""
        if isinstance(event, ObservationsChanged | DistancesCorrected) or (
            isinstance(event, Update) and event.state in ENDED
        ):
            self.wake()

    def _step(self) -> float:
        began_s = time.monotonic()
        for _ in self._indexer.index_next():
            self._on_indexed()
            took_s = time.monotonic() - began_s
            # People who use the server meanwhile get at least half of its time.
            if self._pause(max(took_s, _LEAST_PAUSE_S)):
                break
            began_s = time.monotonic()
        return _LOOK_EVERY_S
