"""Records of an inspection: its observations, and every change as an event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import Any

from app.survey.observations.tag import StatedTag, entered
from app.survey.versions import version_of

CHAINAGE = "Chainage"
"""Author in the history of what no person stated."""
RESCALED = "rescaled"
"""Action of an event that Chainage itself caused: joints changed the scale."""
SMOOTHED = "smoothed"
"""Action of an event that Chainage itself caused: the final track moved observations that were made
on its live rows."""
RIG_CHANGED = "rig_changed"
"""Action of an event: the film was tracked again with another rig."""
REVIEWED = "reviewed"
"""Action of an event: the review of the inspection has reached another state."""
LABELLED = "labelled"
"""Action of an event: the labels of the inspection were replaced."""
NOT_NOTIFIED = "not_told"
"""Action of an event: the client could not be notified of an observation."""
BROUGHT_IN = "imported"
"""Action of an event: the inspection was imported from another server, unchanged."""

DELIVERED = "delivered"
"""Action of an event: a link was made by which a client sees the inspection."""
CLIENT_ACCEPTED = "client_accepted"
CLIENT_ASKED = "client_asked"
"""Actions of events: what a client said by such a link."""
CLIENT_ANSWERED = "client_answered"
"""Action of an event: a question of a client was answered."""


@dataclass(frozen=True, kw_only=True)
class Observation:
    """A defect or a note, anchored to a frame and a pixel; its distance is never stored."""

    inspection_id: str
    id: str
    """UUID made by the client, so that a repeated PUT names the same observation."""
    seq: int
    """Sequence number 1, 2, ... within the inspection; never reused."""
    tag: StatedTag
    photo_frame: int | None = None
    """The frame that the photo shows; None while there is none."""
    photo_sha256: str | None = None
    photo_error: str | None = None
    """Why there is no photo, or why the photo of an import is missing."""
    created_at: datetime
    created_by: str
    edited_at: datetime | None = None
    edited_by: str | None = None
    deleted_at: datetime | None = None

    @cached_property
    def version(self) -> str:
        """Version of what a person entered."""
        return version_of(entered(self.tag.to_json()))

    @property
    def frame(self) -> int:
        """Row of the track, and index of the frame in the film."""
        return self.tag.frame

    @property
    def is_photographed(self) -> bool:
        """Whether a photo of its frame exists, here or where it was exported."""
        return self.photo_frame == self.frame

    @property
    def has_photo(self) -> bool:
        """Whether that photo is stored here."""
        return self.is_photographed and self.photo_error is None


@dataclass(frozen=True, kw_only=True)
class Event:
    """A change: who changed what, when, from what to what. It is never changed or deleted."""

    id: int = 0
    """Rises with time; 0 until the event is stored."""
    inspection_id: str
    observation_id: str | None = None
    """None if the event is about the inspection."""
    action: str
    who: str
    at: datetime
    before: Mapping[str, Any] | None = None
    after: Mapping[str, Any] | None = None
    remark: str | None = None
    """The reason, in the person's own words."""
