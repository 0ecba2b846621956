"""Assets of a register and their inspections, stored before the server starts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any
from uuid import UUID

from builders import clip_rig
from sqlalchemy import insert

from app.storage.database.database import Database
from app.storage.database.tables import Base, Inspection, ObservationRow, RegisteredAsset
from app.survey.assets.box import box_around
from app.survey.folding import folded, normalised_id

MADE_AT = datetime(2026, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class Registered:
    """An asset of the register, on a line of [longitude, latitude]."""

    asset: str
    line: list[list[float]] = field(default_factory=list)
    project: str | None = None


@dataclass(frozen=True)
class Inspected:
    """An inspection of an asset, with a tag of each severity; places are header fields."""

    asset: str
    day: str
    severities: tuple[int, ...] = ()
    project: str | None = None
    place: dict[str, Any] = field(default_factory=dict)
    status: str = "done"


def fill(
    database: Database, registered: Iterable[Registered], inspected: Iterable[Inspected]
) -> None:
    """Store them; the server indexes the inspections once it runs."""
    surveys = list(enumerate(inspected))
    tags = [
        (number, seq, severity)
        for number, survey in surveys
        for seq, severity in enumerate(survey.severities, 1)
    ]
    rows: dict[type[Base], list[dict[str, Any]]] = {
        RegisteredAsset: [registered_row(asset) for asset in registered],
        Inspection: [inspection_row(number, survey) for number, survey in surveys],
        ObservationRow: [_observation(*tag) for tag in tags],
    }

    def store(session: Any) -> None:
        for table, some in rows.items():
            if some:
                session.execute(insert(table), some)

    database.write(store)


def registered_row(asset: Registered) -> dict[str, Any]:
    """Values of its row."""
    return {
        "asset_id": asset.asset, "normalised_id": normalised_id(asset.asset),
        "project": asset.project,
        "header": {}, "line": asset.line, **box_around(asset.line),
        "folded": folded(asset.asset, asset.project),
        "changed_at": MADE_AT, "changed_by": "test",
    }  # fmt: skip


def inspection_row(number: int, survey: Inspected) -> dict[str, Any]:
    """Values of its row; the id is made of the number."""
    header = {"asset_id": survey.asset, "date": survey.day, "project": survey.project}
    return {
        "id": f"{number:032x}", "name": f"{survey.asset} {survey.day}", "status": survey.status,
        "rig": clip_rig(), "header": header | survey.place, "project": survey.project,
        "source_kind": "upload",
        "source_filename": "a.mp4", "source_size": 1, "source_sha256": "0" * 64,
        "video_file": "video.mp4", "video": {}, "corrections": {}, "revision": 0,
        "created_at": MADE_AT, "queued_at": MADE_AT, "finished_at": MADE_AT, "priority": 0,
        "attempt": 0,
    }  # fmt: skip


def _observation(number: int, seq: int, severity: int) -> dict[str, Any]:
    return {
        "inspection_id": f"{number:032x}", "id": str(UUID(int=100 * number + seq)), "seq": seq,
        "frame": 0, "fields": {"frame": 0, "code": "BAB", "severity": severity},
        "created_at": MADE_AT, "created_by": "test",
    }  # fmt: skip
