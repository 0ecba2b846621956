"""Content of forms: codes, header fields, preset rigs."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from app import errors
from app.inspections.packs import Packs
from app.survey.catalogue.presets import PRESETS
from app.survey.fields.header import FIELDS
from app.survey.given import PackId
from app.web.deps import Service, of_projects, viewer
from app.web.schemas.failures import failures
from app.web.schemas.library.catalogue import (
    CodeOut,
    HeaderFieldOut,
    HeaderFieldsOut,
    PresetOut,
    PresetsOut,
)

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/codes", responses=failures(errors.PackNotFound))
@viewer
@of_projects
def all_codes(
    packs: Service[Packs],
    pack: Annotated[
        PackId | None, Query(description="Id of an imported pack; the built-in one without it.")
    ] = None,
) -> list[CodeOut]:
    """Return the codes of a pack, in its order."""
    return [CodeOut.model_validate(code) for code in packs.table(pack).rows]


@router.get("/header-fields")
@viewer
@of_projects
def header_fields() -> HeaderFieldsOut:
    """Return the fields that describe an inspection, in the order of a form."""
    return HeaderFieldsOut(fields=[HeaderFieldOut.model_validate(field) for field in FIELDS])


@router.get("/presets")
@viewer
@of_projects
def presets() -> PresetsOut:
    """Return example rigs to start from."""
    return PresetsOut(
        presets=[
            PresetOut(name=preset.name, rig=preset.rig.model_dump(mode="json"))
            for preset in PRESETS
        ]
    )
