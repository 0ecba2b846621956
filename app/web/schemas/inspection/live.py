"""Messages of a live socket, and picture health."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from pydantic import BaseModel

from app.inspections.presence import Person
from app.storage.database.tables import ENDED
from app.survey.distances.notices import Notice
from app.tracking.live import Update
from app.tracking.tracks import HealthColumns
from app.viewer.clicks import Click
from app.viewer.geometry import PinHit
from app.web.schemas.inspection.inspections import ProgressOut
from vo_core.image.health import Health, complained, complaints
from vo_core.track import COLUMNS, Estimate


def click_message(click: Click) -> dict[str, object]:
    """Return the message for a shift-click in the 3D view."""
    if isinstance(click, PinHit):
        return {"type": "pin_click", "observation": click.id}
    return {
        "type": "wall_click",
        "distance_m": round(click.distance_m, 4),
        "clock_h": None if click.clock_h is None else round(click.clock_h, 3),
        "lateral_m": round(click.lateral_m, 4),
    }


def people_message(others: Sequence[Person]) -> dict[str, object]:
    """Return the message with the others who have the inspection open."""
    return {"type": "people", "others": [asdict(person) for person in others]}


def health_of(health: Health | None) -> dict[str, Any] | None:
    """Return the health of one frame, for the header of the live socket."""
    if health is None:
        return None
    numbers = {name: round(value, 3) for name, value in asdict(health).items()}
    return numbers | {"complaints": list(complaints(health))}


class HealthOut(BaseModel):
    """Picture health of the frames; all numbers in [0, 1]."""

    columns: dict[str, list[float] | list[str]]
    """overlap, brightness, overexposed, sharpness, fixed_pattern; and complaints, separated by
    spaces: too_fast too_dark too_bright blurred lens_dirty."""

    @classmethod
    def of(cls, columns: HealthColumns, since: int) -> HealthOut:
        """Convert the service's columns."""
        shown = {name: column[since:] for name, column in columns.columns().items()}
        numbers: dict[str, list[float] | list[str]] = {
            name: np.round(column.astype(np.float64), 3).tolist() for name, column in shown.items()
        }
        # Many frames, few different complaints: each is put into words once.
        found = complained(shown)
        bits = np.array([1 << n for n in range(len(found))])
        ways, way = np.unique(bits @ np.array(list(found.values())), return_inverse=True)
        said = [
            " ".join(name for bit, name in zip(bits, found, strict=True) if one & bit)
            for one in ways
        ]
        return cls.model_construct(columns=numbers | {"complaints": [said[n] for n in way]})


def live_header(
    update: Update,
    corrected: Estimate | None,
    revision: int | None,
    joints: int | None,
    notices: Sequence[Notice],
    now_s: float,
) -> dict[str, Any]:
    """Return the header of one message of the live socket.

    Args:
        update: The published update.
        corrected: Its corrected last estimate.
        revision: Revision of the corrections; None if the inspection has been deleted.
        joints: Number of seen and expected joints; None likewise.
        notices: Where picture and rig disagree.
        now_s: Present time by `time.monotonic`.
    """
    last = update.estimates[-1] if update.estimates else None
    camera = update.camera
    age_s = None if update.captured_s is None else now_s - update.captured_s
    # The page shows the whole uncertainty.
    shown = (name for name in COLUMNS if name != "sigma_registration_mm")
    pose = {name: getattr(corrected, name, None) for name in shown}
    return pose | {
        "seq": update.seq,
        "state": update.state,
        "progress": ProgressOut.model_validate(update.progress).model_dump(),
        "revision": revision,
        "joints": joints,
        "notices": [notice.code for notice in notices],
        "distance_raw_mm": last.distance_mm if last else None,
        "age_ms": None if age_s is None else round(1000 * age_s, 1),
        "camera": None
        if camera is None or update.state in ENDED
        else ("connected" if camera.connected else "reconnecting"),
        "dropped": 0 if camera is None else camera.dropped,
        "health": health_of(update.health),
    }
