"""A tag: what a person states about a defect or a note at a frame and a pixel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, StringConstraints

from app.survey.given import LINE, TEXT, Clock, CodeName, Frame, Given, Letter, Pixel
from app.survey.measure import Measures

LONGEST_IMPORTED_REMARK = 40_000
"""Characters; other programs allow longer remarks than this page."""

Quantity = Annotated[float, Field(ge=-1e6, le=1e6)]
Severity = Annotated[int, Field(ge=0, le=5)]


class Tag(Given):
    """The fields that a person enters; everything else is derived. Only `frame` is required."""

    frame: Frame
    pixel: Pixel | None = Field(
        None, description="[u, v] of the wall point; without it the camera's distance counts."
    )
    code: CodeName | None = None
    char1: Letter | None = None
    char2: Letter | None = None
    quant1: Quantity | None = None
    quant2: Quantity | None = None
    clock_from: Clock | None = None
    clock_to: Clock | None = None
    severity: Severity | None = Field(
        None, description="0 note, 1 as new, 2 slight, 3 watch, 4 plan repair, 5 act now."
    )
    continuous: Annotated[str, StringConstraints(pattern=r"^[ABC][1-9][0-9]{0,2}$")] | None = Field(
        None, description="Mark of a stretch: A1 starts, C1 changes, B1 finishes number 1."
    )
    remark: Annotated[str, StringConstraints(max_length=4000, pattern=TEXT)] | None = None
    recommendation: Annotated[str, StringConstraints(max_length=1000, pattern=TEXT)] | None = Field(
        None, description="What should be done about it."
    )
    cost: Annotated[float, Field(ge=0, le=1e9)] | None = Field(
        None, description="Estimated cost of that, in the currency of the report's template."
    )
    measures: Measures | None = Field(
        None, description="What was measured on the wall; the answer has the figures in `measured`."
    )


class StatedTag(Tag):
    """A stored tag, with the fields that only the file of an imported survey states."""

    remark: (
        Annotated[str, StringConstraints(max_length=LONGEST_IMPORTED_REMARK, pattern=TEXT)] | None
    ) = None
    at_joint: bool | None = None
    photo_name: Annotated[str, StringConstraints(max_length=255, pattern=LINE)] | None = None
    film_time_s: Annotated[float, Field(ge=0, le=1e9)] | None = None
    """Time in the film, which is not here."""

    @classmethod
    def kept(cls, fields: Mapping[str, Any]) -> StatedTag:
        """Build a tag from stored fields, which were checked when they were accepted."""
        return cls.model_construct(**fields)

    def to_json(self) -> dict[str, Any]:
        """Return only the stated fields, in their order, as stored and exported."""
        return {
            name: value
            for name in type(self).model_fields
            if (value := getattr(self, name)) is not None
        }


def entered(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that a person enters, without those of an import."""
    return {name: fields[name] for name in Tag.model_fields if fields.get(name) is not None}
