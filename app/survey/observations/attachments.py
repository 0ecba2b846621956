"""What is attached to an observation: further photos, drawings on a photo, voice notes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from app.survey.given import LINE, Frame, Given, Pixel

Kind = Literal["photo", "drawing", "voice"]
Colour = Literal["red", "yellow", "white", "blue"]
LONGEST_VOICE_S = 120.0
MOST_VOICE_BYTES = 2**20
MOST = 50
"""Most attachments of one observation, deleted ones included."""
VOICE_SUFFIXES: Mapping[str, str] = {
    "audio/webm": ".webm",
    "audio/ogg": ".ogg",
    "audio/mp4": ".m4a",
}
"""Suffix of a file by the media type that a browser's recorder gives."""


class Stroke(Given):
    """One mark of a drawing, in pixels of the photo; pixel centres are at integers."""

    kind: Literal["arrow", "line", "text"]
    """An arrow points at its last point; a line is drawn by hand; a text begins at its point."""
    points: Annotated[list[Pixel], Field(min_length=1, max_length=2000)]
    colour: Colour
    text: Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=LINE)] | None = (
        None
    )

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        if (self.kind == "text") != (self.text is not None):
            raise ValueError("a stroke has a text if it is one, and only then")
        if self.kind == "arrow" and len(self.points) != 2:
            raise ValueError("an arrow has two points")
        return self


Strokes = Annotated[list[Stroke], Field(max_length=200)]


class Picture(Given):
    """A photo of another frame, or a drawing on a copy of one: what a person states about it."""

    kind: Literal["photo", "drawing"]
    frame: Frame
    rank: Annotated[int, Field(ge=-1000, le=1000)] = Field(
        0, description="Place among the photos; the observation's own has 0, the first is shown."
    )
    strokes: Strokes = Field(default_factory=list)

    @model_validator(mode="after")
    def _only_drawings_have_strokes(self) -> Self:
        if self.kind == "photo" and self.strokes:
            raise ValueError("only a drawing has strokes; the photo stays as it was taken")
        return self


@dataclass(frozen=True, kw_only=True)
class Attachment:
    """A stored attachment of an observation."""

    inspection_id: str
    id: str
    """UUID made by the client, so that a repeated PUT names the same attachment."""
    observation_id: str
    kind: Kind
    rank: int
    frame: int
    """Frame that a photo shows; of a voice note that of its observation."""
    strokes: tuple[Stroke, ...] = ()
    media_type: str | None = None
    """Of a voice note, like the next two."""
    duration_s: float | None = None
    size: int | None = None
    sha256: str | None = None
    """Of its file; None while the picture is not made."""
    photo_error: str | None = None
    """Why there is no picture, or why that of an import is missing."""
    created_at: datetime
    created_by: str
    deleted_at: datetime | None = None

    @property
    def photo_sha256(self) -> str | None:
        """Digest of its file, called like that of an observation's photo."""
        return self.sha256

    @property
    def is_photographed(self) -> bool:
        """Whether its file exists, here or where it was exported."""
        return self.sha256 is not None

    @property
    def has_photo(self) -> bool:
        """Whether it is a picture that is stored here."""
        return self.kind != "voice" and self.has_file

    @property
    def has_file(self) -> bool:
        """Whether its file is stored here."""
        return self.is_photographed and self.photo_error is None

    def stated(self) -> dict[str, Any]:
        """Return what a person stated, for the history."""
        return {"attachment": self.kind, "at_frame": self.frame}


def in_order(attachments: list[Attachment]) -> list[Attachment]:
    """Return attachments in the order in which they are shown."""
    return sorted(attachments, key=lambda one: (one.rank, one.created_at, one.id))
