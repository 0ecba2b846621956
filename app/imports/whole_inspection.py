"""An inspection as it was exported: everything from which distances are derived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from app.survey.stated import Stated
from app.survey.tag import StatedTag
from vo_core import Rig, Track
from vo_core.geometry.stance import Stance
from vo_core.geometry.tilt import MountTilt
from vo_core.image.health import Health
from vo_core.joints.finder import Sighting


@dataclass(frozen=True)
class ImportedTag:
    """An observation as it was stated."""

    id: str
    seq: int
    fields: Mapping[str, Any]
    """Fields of the PUT; fields that it left out are missing."""
    photo_sha256: str | None
    """Digest of its photo, which is not in the file."""
    created_by: str
    created_at: datetime
    edited_by: str | None
    edited_at: datetime | None

    @property
    def stated(self) -> StatedTag:
        """Return the fields, which were checked when the file was read."""
        return StatedTag.kept(self.fields)


@dataclass(frozen=True)
class Happening:
    """An event of the inspection where it was exported."""

    at: datetime
    who: str
    action: str
    observation_id: str | None
    before: Mapping[str, Any] | None
    after: Mapping[str, Any] | None
    remark: str | None


@dataclass(frozen=True)
class WholeInspection:
    """An inspection as it was exported."""

    id: str
    """Id where it was exported."""
    name: str
    status: Literal["queued", "running", "done", "failed", "cancelled"]
    header: Mapping[str, Any]
    labels: tuple[str, ...]
    rig: Rig
    source_kind: Literal["upload", "live", "import"]
    source_filename: str
    source_size: int
    source_sha256: str
    video: Mapping[str, Any]
    """Result of probing the video, which is not here."""
    warning: str | None
    error: str | None
    error_code: str | None
    created_at: datetime
    finished_at: datetime | None
    stated: Stated
    revision: int
    track: Track
    """The raw track; row i is frame i."""
    health: Sequence[Health]
    sightings: tuple[Sighting, ...]
    tilt: MountTilt | None
    stance: Stance
    tags: tuple[ImportedTag, ...]
    """Tags in the order of their numbers."""
    events: tuple[Happening, ...]
    """Events, the oldest first."""
