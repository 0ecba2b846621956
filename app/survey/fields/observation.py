"""The columns that exchange formats have for the fields of an observation."""

from __future__ import annotations

from collections.abc import Mapping

from app.survey.fields.declaration import Column, Family, HeldIn, at
from app.survey.observations.tag import StatedTag

_COLUMNS: Mapping[str, Mapping[str, Column]] = {
    "distance_m": at(en="I", isybau="Station", m150="HZ001", wincan="OBS_Distance"),
    **{
        name: held.columns
        for name, field in StatedTag.model_fields.items()
        for held in field.metadata
        if isinstance(held, HeldIn)
    },
}


def codes_of(family: Family) -> Mapping[str, tuple[str, ...]]:
    """Return the codes of the columns of a format by the fields that they hold, none for others."""
    return {
        name: columns[family].codes if family in columns else ()
        for name, columns in _COLUMNS.items()
    }
