"""Where the assets are by the register and by the headers of their inspections."""

from __future__ import annotations

from datetime import date
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading
from app.storage.database.tables import IndexedInspection, Inspection, RegisteredAsset
from app.storage.index.queries import HAS_RUN, NEWEST_LAST


class RegisteredPlace(NamedTuple):
    """An asset of the register."""

    asset: str
    normalised_id: str
    project: str | None
    line: list[list[float]]
    """Longitude and latitude in degrees from start to end; may be empty."""


class SurveyedPlace(NamedTuple):
    """What an inspection says of its asset."""

    asset: str
    normalised_id: str
    project: str | None
    has_run: bool
    surveyed_on: date
    worst_severity: int | None
    start_lon: float | None
    start_lat: float | None
    end_lon: float | None
    end_lat: float | None

    @property
    def line(self) -> list[list[float]]:
        """Longitude and latitude in degrees of the ends that the header states."""
        ends = ((self.start_lon, self.start_lat), (self.end_lon, self.end_lat))
        return [[lon, lat] for lon, lat in ends if lon is not None and lat is not None]


SURVEYED = select(
    IndexedInspection.asset,
    IndexedInspection.asset_normalised_id,
    IndexedInspection.project,
    HAS_RUN,
    IndexedInspection.surveyed_on,
    IndexedInspection.worst_severity,
    IndexedInspection.start_lon,
    IndexedInspection.start_lat,
    IndexedInspection.end_lon,
    IndexedInspection.end_lat,
).join(Inspection, Inspection.id == IndexedInspection.inspection_id)
"""The fields of a `SurveyedPlace`."""


class AssetPlaces(Store):
    """Reads the register and the index for the map."""

    @reading
    def read(
        self, session: Session, normalised_id: str | None
    ) -> tuple[list[RegisteredPlace], list[SurveyedPlace]]:
        """Return the register by id, and the inspections from the oldest to the newest; those that
        were not tracked yet come before all others.

        Args:
            normalised_id: Of the only assets that are wanted; None for all.
        """
        registered = select(
            RegisteredAsset.asset_id,
            RegisteredAsset.normalised_id,
            RegisteredAsset.project,
            RegisteredAsset.line,
        ).order_by(RegisteredAsset.asset_id)
        surveyed = SURVEYED.where(IndexedInspection.asset_normalised_id.is_not(None)).order_by(
            *NEWEST_LAST, Inspection.created_at
        )
        if normalised_id is not None:
            registered = registered.where(RegisteredAsset.normalised_id == normalised_id)
            surveyed = surveyed.where(IndexedInspection.asset_normalised_id == normalised_id)
        return (
            [RegisteredPlace._make(row) for row in session.execute(registered)],
            [SurveyedPlace._make(row) for row in session.execute(surveyed)],
        )
