"""Attachments of observations."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from pydantic import BaseModel

from app.survey.observations.attachments import Attachment, Kind
from app.web.schemas.out import Out


class AttachmentOut(Out):
    """A photo, a drawing or a voice note of an observation."""

    id: str
    observation_id: str
    kind: Kind
    rank: int
    frame: int
    strokes: list[dict[str, Any]]
    """Of a drawing, in pixels of the photo."""
    duration_s: float | None
    """Of a voice note."""
    file: str | None
    """Address of the photo as it was taken, or of the voice note; None until it is made."""
    photo_error: str | None
    created_at: datetime
    created_by: str

    @classmethod
    def of(cls, attachment: Attachment) -> AttachmentOut:
        """Convert the record."""
        a = attachment
        path = f"/api/inspections/{a.inspection_id}/observations/{a.observation_id}"
        name = "voice" if a.kind == "voice" else "photo"
        return cls.read_from(
            a,
            strokes=[stroke.model_dump(exclude_none=True) for stroke in a.strokes],
            file=f"{path}/attachments/{a.id}/{name}" if a.has_file else None,
        )


class AttachmentsOut(BaseModel):
    """The attachments of an inspection that are not deleted, in the order of their ranks."""

    attachments: list[AttachmentOut]
