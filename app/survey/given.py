"""Types for the fields of requests: strict, bounded, without control characters."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from app.survey.fields.header import LONGEST_TEXT, faults


class Given(BaseModel):
    """Base of strict models: JSON false is not a number, NaN and unknown fields are refused."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


# No control characters: names are written to files, tables and logs.
LINE = r"^[^\x00-\x1f\x7f-\x9f]*$"
TEXT = r"^[^\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]*$"
Name = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200, pattern=LINE)
]


def _known_fields_fit(header: dict[str, Any]) -> dict[str, Any]:
    """Check known fields; others may hold anything, since surveys are imported from other
    programs.
    """
    if found := faults(header):
        raise ValueError("; ".join(found))
    return header


HeaderName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,49}$")]
HeaderText = Annotated[str, StringConstraints(max_length=LONGEST_TEXT, pattern=TEXT)]
_EXACT = Field(ge=1 - 2**53, le=2**53 - 1)
"""Bounds of whole numbers that every JSON reader holds exactly, browsers too."""
Header = Annotated[
    dict[HeaderName, HeaderText | Annotated[int, _EXACT] | Annotated[float, _EXACT] | bool | None],
    Field(
        max_length=100,
        description="What was inspected, by whom, for whom; /api/header-fields lists the known "
        "fields and their allowed values.",
    ),
    AfterValidator(_known_fields_fit),
]
CodeName = Annotated[str, StringConstraints(pattern=r"^[A-Z][A-Z0-9]{0,7}$")]
PackName = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=100, pattern=LINE)
]
PackId = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
Letter = Annotated[str, StringConstraints(pattern=r"^[A-Z][A-Z0-9]{0,3}$")]
Clock = Annotated[int, Field(ge=1, le=12)]
Coordinate = Annotated[float, Field(ge=-100_000, le=100_000)]
Pixel = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
"""The service checks whether the picture has this pixel."""
Frame = Annotated[int, Field(ge=0, le=2**31 - 1)]
Metres = Annotated[float, Field(gt=0, le=100_000)]
Remark = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=4000, pattern=TEXT)
]
