"""Reports of many inspections as one archive."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import BaseModel, Field

from app.reports.bulk import Progress, State, Wanted
from app.reports.content.words import Language
from app.reports.formats import FORMATS
from app.reports.report import Units
from app.survey.given import Given

_MOST_SHOWN = 200

InspectionRef = Annotated[str, Field(pattern=r"^[0-9a-f]{32}$")]
Kind = Annotated[str, Field(pattern=f"^({'|'.join(FORMATS)})$")]


class BulkExportIn(Given):
    """What the archive is to hold."""

    inspections: list[InspectionRef] = Field(
        min_length=1, max_length=1000, description="Ids, in the order of the archive."
    )
    formats: list[Kind] = Field(
        min_length=1, max_length=len(FORMATS), description="One file of each for each inspection."
    )
    lang: Language = "en"
    units: Units = "m"
    burnt_in: bool = Field(False, description="Distance and code below each photo.")
    clips: bool = Field(False, description="The seconds around each observation, in the bundle.")

    def wanted(self) -> Wanted:
        """Return the order; what is named twice is made once."""
        return Wanted(
            tuple(dict.fromkeys(self.inspections)),
            tuple(dict.fromkeys(self.formats)),
            self.lang,
            self.units,
            self.burnt_in,
            self.clips,
        )


class NotMadeOut(BaseModel):
    """A file that is missing in the archive."""

    inspection_id: str
    name: str
    """Of the inspection; empty if it was deleted."""
    format: str
    detail: str


class BulkExportOut(BaseModel):
    """How far an archive is."""

    id: str
    state: State
    done: int
    """Inspections that are in the archive."""
    total: int
    present: str | None
    """Name of the inspection whose reports are being made."""
    not_made: list[NotMadeOut]
    """The first 200 files that could not be made; the archive lists all of them."""
    not_made_total: int
    size: int | None
    """Bytes of the archive, once it is whole."""
    detail: str | None
    """Why it failed."""

    @classmethod
    def of(cls, progress: Progress) -> Self:
        """Convert the progress of an order."""
        return cls(
            id=progress.id,
            state=progress.state,
            done=progress.done,
            total=progress.total,
            present=progress.present,
            not_made=[
                NotMadeOut(
                    inspection_id=one.inspection_id,
                    name=one.name,
                    format=one.kind,
                    detail=one.detail,
                )
                for one in progress.not_made[:_MOST_SHOWN]
            ],
            not_made_total=len(progress.not_made),
            size=progress.size,
            detail=progress.detail,
        )
