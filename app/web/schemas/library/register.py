"""The register of assets."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, Field

from app.inspections.register import Import, version_of_asset
from app.storage.database.tables import RegisteredAsset
from app.survey.assets.cells import MEANINGS, UNITS_MM, own_unit
from app.survey.assets.register import (
    LONGEST_REGISTERED,
    MOST_POINTS,
    Asset,
    Line,
    registered,
    require_line,
)
from app.survey.assets.register_table import Action, Named, Reason, Step
from app.survey.fields.header import ASSET_FIELDS
from app.survey.given import Given, Header, Name
from app.web.schemas.out import Out

_SHOWN_ROWS = 200
"""Rows and faults of an answer: a table may have many thousands."""


def _of_an_asset(header: dict[str, Any]) -> dict[str, Any]:
    if foreign := header.keys() - set(ASSET_FIELDS):
        raise ValueError(f"{min(foreign)} is no field of an asset; known are {ASSET_FIELDS}")
    if long := [name for name, value in header.items() if len(str(value)) > LONGEST_REGISTERED]:
        raise ValueError(f"{long[0]} is longer than {LONGEST_REGISTERED} characters")
    return header


def _on_the_globe(points: list[list[float]]) -> list[list[float]]:
    require_line(_line_of(points))
    return points


def _line_of(points: Sequence[Sequence[float]]) -> Line:
    return tuple((lon, lat) for lon, lat in points)


class ProjectIn(Given):
    """A project to make."""

    name: Name


class AssetIn(Given):
    """What the register holds of an asset."""

    project: Name | None = None
    header: Annotated[Header, AfterValidator(_of_an_asset)] = Field(
        default={}, description="Fields of a header that belong to the asset."
    )
    line: Annotated[
        list[Annotated[list[float], Field(min_length=2, max_length=2)]],
        Field(max_length=MOST_POINTS),
        AfterValidator(_on_the_globe),
    ] = Field(
        default=[],
        description="Longitude and latitude in degrees (WGS 84) from the start to the end; one "
        "point or none if more is not known.",
    )

    def to_asset(self, asset_id: str) -> Asset:
        """Return the asset of this id."""
        return registered(asset_id, self.project, self.header, _line_of(self.line))


class RegisteredAssetOut(Out):
    """An asset of the register."""

    asset_id: str
    project: str | None
    header: dict[str, Any]
    line: list[Annotated[list[float], Field(min_length=2, max_length=2)]]
    changed_at: datetime
    changed_by: str
    version: str
    """The `ETag` of the asset."""

    @classmethod
    def of(cls, row: RegisteredAsset) -> Self:
        """Convert the row."""
        return cls.read_from(row, version=version_of_asset(row))


class RegisterOut(BaseModel):
    """A page of the register, sorted by id."""

    total: int
    assets: list[RegisteredAssetOut]


class AlikeOut(Out):
    """What is known under all ways of writing an id."""

    same: list[str]
    """Ids of the register and of inspected assets that differ only in case, spaces and signs."""
    fields: dict[str, Any] | None
    """Fields of a header as the register has them; null if it does not have this id."""


class ImportFaultOut(Out):
    """What is wrong in one place of a table."""

    row: int
    """Number of the line in the file."""
    column: str | None
    """Null for the row as a whole."""
    detail: str
    reason: Reason
    """Its kind, for pages in other languages."""
    found: str
    """What varies in it: the cell, the line that has the same asset, the number of cells."""


class ImportWarningOut(BaseModel):
    """A row that may state an asset that is known under another id."""

    row: int
    asset_id: str
    same: list[str]
    """Other ways of writing the id."""


class ImportFieldOut(BaseModel):
    """What a column of a table may hold."""

    name: str
    units: list[str]
    """Units of a length; none of what is no length."""


class ImportColumnOut(BaseModel):
    """A column of a table, and what it holds."""

    name: str
    examples: list[str]
    """Some of its cells."""
    field: str | None
    """Null if it is not used."""
    unit: str | None

    @classmethod
    def of(cls, named: Named) -> Self:
        """Convert the column."""
        held = named.column
        return cls(
            name=named.name,
            examples=list(named.examples),
            field=held.field if held else None,
            unit=held.unit if held else None,
        )


class ImportRowOut(BaseModel):
    """What the import of a row does."""

    row: int
    asset_id: str
    action: Action
    header: dict[str, Any]
    """Fields of the asset after the import; none of a row with a fault."""


class RegisterImportOut(Out):
    """What an import did, or would do; rows with faults are left out."""

    added: int
    changed: int
    same: int
    faulty: int
    """Rows with faults."""
    faults: list[ImportFaultOut]
    """The first 200, like warnings and rows."""
    warnings: list[ImportWarningOut]
    rows: list[ImportRowOut]
    columns: list[ImportColumnOut]
    fields: list[ImportFieldOut]
    """What a column may hold."""

    @classmethod
    def of(cls, found: Import) -> Self:
        """Convert the service's answer."""
        steps = {step.row: step for step in found.steps}
        ids = dict(found.table.rows)
        done = [step.action for step in found.steps]
        return cls.read_from(
            found.table,
            added=done.count("add"),
            changed=done.count("change"),
            same=done.count("same"),
            faulty=len({fault.row for fault in found.table.faults}),
            faults=found.table.faults[:_SHOWN_ROWS],
            warnings=[
                ImportWarningOut(row=row, asset_id=ids[row], same=list(same))
                for row, same in list(found.alike.items())[:_SHOWN_ROWS]
            ],
            rows=[
                _row_of(row, asset_id, steps.get(row))
                for row, asset_id in found.table.rows[:_SHOWN_ROWS]
            ],
            columns=[ImportColumnOut.of(named) for named in found.table.columns],
            fields=_FIELDS,
        )


_FIELDS = [
    ImportFieldOut(name=name, units=list(UNITS_MM) if own_unit(name) else []) for name in MEANINGS
]


def _row_of(row: int, asset_id: str, step: Step | None) -> ImportRowOut:
    if step is None:
        return ImportRowOut(row=row, asset_id=asset_id, action="fault", header={})
    header = dict(step.asset.header)
    return ImportRowOut(row=row, asset_id=asset_id, action=step.action, header=header)
