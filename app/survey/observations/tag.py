"""A tag: what a person states about a defect or a note at a frame and a pixel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, StringConstraints

from app.survey.fields.declaration import held_in
from app.survey.given import LINE, TEXT, Clock, CodeName, Frame, Given, Letter, Pixel
from app.survey.places.measure import Measures

LONGEST_IMPORTED_REMARK = 40_000
"""Characters; other programs allow longer remarks than this page."""

Quantity = Annotated[float, Field(ge=-1e6, le=1e6)]
Severity = Annotated[int, Field(ge=0, le=5)]


_REMARK = held_in(en="F", isybau="Kommentar", m150="HZ010", wincan="OBS_Observation OBS_Memo")


class Coded(Given):
    """A code, with what is said of each defect of it."""

    # What exchange formats hold has its columns beside its type; they have the severity in words
    # behind the remark, and nothing else of a tag.
    code: Annotated[
        CodeName | None,
        held_in(en="A", isybau="InspektionsKode", m150="HZ002", wincan="OBS_OpCode"),
    ] = Field(None, description="Main code; unknown for a tag whose details are still to come")
    char1: Annotated[
        Letter | None,
        held_in(en="B", isybau="Charakterisierung1", m150="HZ014", wincan="OBS_Char1"),
    ] = Field(None, description="First characterisation of the code")
    char2: Annotated[
        Letter | None,
        held_in(en="C", isybau="Charakterisierung2", m150="HZ015", wincan="OBS_Char2"),
    ] = Field(None, description="Second characterisation of the code")
    quant1: Annotated[
        Quantity | None,
        held_in(
            en="D",
            isybau="Quantifizierung1Numerisch Quantifizierung1Text",
            m150="HZ003",
            wincan="OBS_Q1_Value",
        ),
    ] = Field(None, description="First quantity")
    quant2: Annotated[
        Quantity | None,
        held_in(
            en="E",
            isybau="Quantifizierung2Numerisch Quantifizierung2Text",
            m150="HZ004",
            wincan="OBS_Q2_Value",
        ),
    ] = Field(None, description="Second quantity")
    clock_from: Annotated[
        Clock | None, held_in(en="G", isybau="PositionVon", m150="HZ006", wincan="OBS_ClockPos1")
    ] = Field(None, description="Clock position, or where its sector begins: 12 crown, 6 invert")
    clock_to: Annotated[
        Clock | None, held_in(en="H", isybau="PositionBis", m150="HZ007", wincan="OBS_ClockPos2")
    ] = Field(None, description="Where the sector ends, clockwise in the direction of travel")
    severity: Severity | None = Field(
        None, description="0 note, 1 as new, 2 slight, 3 watch, 4 plan repair, 5 act now"
    )


class Tag(Coded):
    """The fields that a person enters; everything else is derived. Only `frame` is required."""

    frame: Frame = Field(description="Number of the frame; the first one is 0")
    pixel: Pixel | None = Field(
        None, description="[u, v] of the wall point; without it the camera's distance counts."
    )
    continuous: Annotated[
        Annotated[str, StringConstraints(pattern=r"^[ABC][1-9][0-9]{0,2}$")] | None,
        held_in(
            en="J",
            isybau="Streckenschaden",
            m150="HZ005",
            wincan="OBS_CD_Code1 OBS_CDCode OBS_Continuous",
        ),
    ] = Field(None, description="Mark of a stretch: A1 starts, C1 changes, B1 finishes number 1")
    remark: Annotated[
        Annotated[str, StringConstraints(max_length=4000, pattern=TEXT)] | None, _REMARK
    ] = Field(None, description="In the words of the person who tagged it")
    recommendation: Annotated[str, StringConstraints(max_length=1000, pattern=TEXT)] | None = Field(
        None, description="What should be done about it, as a person accepted it"
    )
    cost: Annotated[float, Field(ge=0, le=1e9)] | None = Field(
        None, description="Estimated cost of that, in the currency of the report's template"
    )
    measures: Measures | None = Field(
        None, description="What was measured on the wall; the answer has the figures in `measured`."
    )


class StatedTag(Tag):
    """A stored tag, with the fields that only the file of an imported survey states."""

    remark: Annotated[
        Annotated[str, StringConstraints(max_length=LONGEST_IMPORTED_REMARK, pattern=TEXT)] | None,
        _REMARK,
    ] = None
    at_joint: Annotated[
        bool | None, held_in(en="K", isybau="Verbindung", m150="HZ011", wincan="OBS_AtJoint")
    ] = None
    photo_name: Annotated[
        Annotated[str, StringConstraints(max_length=255, pattern=LINE)] | None,
        held_in(en="M", isybau="Fotodatei", m150="HZ009"),
    ] = None
    film_time_s: Annotated[
        Annotated[float, Field(ge=0, le=1e9)] | None,
        held_in(en="N", isybau="Timecode", m150="HZ008", wincan="OBS_TimeCtr"),
    ] = None
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


MEANINGS: Mapping[str, str] = {
    name: field.description for name, field in Tag.model_fields.items() if field.description
}
"""What tables say about the fields."""


def entered(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that a person enters, without those of an import."""
    return {name: fields[name] for name in Tag.model_fields if fields.get(name) is not None}
