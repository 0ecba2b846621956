"""Reports of many inspections as one archive."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from app.reports.bulk import Order, State
from app.reports.bulk_archive import Wanted
from app.reports.content.translator import Translator
from app.reports.content.words import Language
from app.reports.formats import EXCHANGE, FORMATS
from app.reports.report import CsvStyle, Extras, Units
from app.survey.given import Given
from app.web.schemas.out import Out

_MOST_SHOWN = 200
MOST_WITH_FILMS = 100
"""Inspections of an order with films or clips, which may fill a disk, or take hours."""

InspectionRef = Annotated[str, Field(pattern=r"^[0-9a-f]{32}$")]
Kind = Annotated[str, Field(pattern=f"^({'|'.join(FORMATS)})$")]
ExchangeKind = Annotated[str, Field(pattern=f"^({'|'.join(EXCHANGE)})$")]


class BulkExportIn(Given):
    """What the archive is to hold."""

    inspections: list[InspectionRef] = Field(
        min_length=1, max_length=1000, description="Ids, in the order of the archive."
    )
    formats: list[Kind] = Field(
        max_length=len(FORMATS), description="One file of each for each inspection."
    )
    document: bool = Field(False, description="One PDF over all inspections.")
    lang: Language = "en"
    units: Units = "m"
    burnt_in: bool = Field(False, description="Distance and code below each photo.")
    clips: bool = Field(False, description="The seconds around each observation, in the bundle.")
    exchange: ExchangeKind = Field("en13508", description="Exchange format of deliveries.")
    film: bool = Field(False, description="The films in deliveries and in archive files.")
    photos: Literal["embedded"] | None = Field(
        None, description="Photos and voice notes in JSON reports."
    )
    csv: CsvStyle = Field(
        "standard", description="`german` writes CSV with semicolons and decimal commas."
    )

    @model_validator(mode="after")
    def _something_of_a_size(self) -> Self:
        if not (self.formats or self.document):
            raise ValueError("names no format and no document")
        if (self.film or self.clips) and len(self.inspections) > MOST_WITH_FILMS:
            raise ValueError(f"has more than {MOST_WITH_FILMS} inspections with films or clips")
        return self

    def wanted(self) -> Wanted:
        """Return the order; what is named twice is made once."""
        return Wanted(
            tuple(dict.fromkeys(self.inspections)),
            tuple(dict.fromkeys(self.formats)),
            Translator(self.lang, self.units),
            Extras(
                burnt_in=self.burnt_in,
                exchange=self.exchange,
                film=self.film,
                photos=self.photos == "embedded",
                csv_style=self.csv,
            ),
            self.clips,
            self.document,
        )


class NotMadeOut(Out):
    """A file that is missing in the archive."""

    inspection_id: str
    name: str
    """Of the inspection; empty if it was deleted."""
    format: str = Field(validation_alias="kind")
    detail: str
    """Why, in the language of the order."""


class BulkExportOut(Out):
    """How far an archive is."""

    id: str
    state: State
    done: int
    """Steps that are done: each inspection in the archive, and each in the document."""
    total: int
    """Steps in all: an inspection counts once for the archive and once for the document."""
    present: str | None
    """Name of the inspection whose reports are being made."""
    not_made: list[NotMadeOut]
    """The first 200 files that could not be made; the archive lists all of them."""
    not_made_total: int
    size: int | None
    """Bytes of the archive, once it is whole."""
    filename: str | None
    """Its name, once it is whole."""
    written: int
    """Bytes that are written so far."""
    detail: str | None
    """Why it failed, in the language of the order."""

    @classmethod
    def of(cls, order: Order) -> Self:
        """Convert an order."""
        return cls.read_from(
            order, not_made=order.not_made[:_MOST_SHOWN], not_made_total=len(order.not_made)
        )
