"""Models of users that find defects on the wall."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import Field, StringConstraints

from app.inspections.findings.detectors import DetectorView
from app.survey.findings.declaration import MOST_CHARACTERS, Declaration
from app.survey.given import Given
from app.web.schemas.out import Out


class DetectorIn(Given):
    """A model in the ONNX format."""

    upload_id: str = Field(description="A complete upload: the .onnx file, all in one")
    declaration: Annotated[str, StringConstraints(max_length=MOST_CHARACTERS)] = Field(
        description="The text of its declaration, YAML or JSON: the fields of `declared`"
    )


class DetectorOut(Out):
    """A model that was checked."""

    id: str
    name: str
    sha256: str
    size: int
    """Bytes."""
    declared: Declaration
    created_at: datetime
    created_by: str

    @classmethod
    def of(cls, view: DetectorView) -> DetectorOut:
        """Convert the service's view."""
        return cls.read_from(view.row, declared=view.declared)


class DetectorsOut(Out):
    """The models, sorted by name; the built-in detector is not listed."""

    detectors: list[DetectorOut]
