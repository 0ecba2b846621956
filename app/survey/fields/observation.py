"""The fields of an observation, and the columns that exchange formats have for them."""

from __future__ import annotations

from app.survey.fields.declaration import Field, Kind, at


def _field(name: str, kind: Kind, **columns: str) -> Field:
    return Field(name, kind, at(**columns))


FIELDS: tuple[Field, ...] = (
    _field("distance_m", "number", en="I", isybau="Station", m150="HZ001", wincan="OBS_Distance"),
    _field("film_time_s", "time", en="N", isybau="Timecode", m150="HZ008", wincan="OBS_TimeCtr"),
    _field("code", "text", en="A", isybau="InspektionsKode", m150="HZ002", wincan="OBS_OpCode"),
    _field("char1", "text", en="B", isybau="Charakterisierung1", m150="HZ014",
           wincan="OBS_Char1"),
    _field("char2", "text", en="C", isybau="Charakterisierung2", m150="HZ015",
           wincan="OBS_Char2"),
    _field("at_joint", "bool", en="K", isybau="Verbindung", m150="HZ011", wincan="OBS_AtJoint"),
    _field("quant1", "number", en="D", isybau="Quantifizierung1Numerisch Quantifizierung1Text",
           m150="HZ003", wincan="OBS_Q1_Value"),
    _field("quant2", "number", en="E", isybau="Quantifizierung2Numerisch Quantifizierung2Text",
           m150="HZ004", wincan="OBS_Q2_Value"),
    _field("continuous", "text", en="J", isybau="Streckenschaden", m150="HZ005",
           wincan="OBS_CD_Code1 OBS_CDCode OBS_Continuous"),
    _field("clock_from", "number", en="G", isybau="PositionVon", m150="HZ006",
           wincan="OBS_ClockPos1"),
    _field("clock_to", "number", en="H", isybau="PositionBis", m150="HZ007",
           wincan="OBS_ClockPos2"),
    _field("photo_name", "text", en="M", isybau="Fotodatei", m150="HZ009"),
    _field("remark", "text", en="F", isybau="Kommentar", m150="HZ010",
           wincan="OBS_Observation OBS_Memo"),
    _field("severity", "number"),
    _field("recommendation", "text"),
    _field("cost", "number"),
    _field("measures", "text"),
)  # fmt: skip
"""What a person states of a defect, in the order of ISYBAU's elements. A field without a column
in a format stands in words behind the remark (severity), or is lost there."""
