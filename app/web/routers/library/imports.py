"""Inspections that come as a whole: old surveys of other programs, exported ones, the sample."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Query

from app import errors
from app.inspections.brought_in.imports import Imports
from app.inspections.brought_in.keeping import Imported
from app.inspections.films.samples import Samples
from app.inspections.inspections import Inspections
from app.reports.content.translator import Translator
from app.reports.content.words import Language
from app.web.deps import PrincipalDep, Service, of_projects, operator, viewer
from app.web.schemas.failures import failures
from app.web.schemas.inspection.inspections import ArchiveIn, ImportedOut, InspectionOut, SampleOut
from app.web.slow import heavy
from vo_core.errors import RigVideoMismatch, UnreadableVideo

router = APIRouter(prefix="/api/imports", tags=["inspections"])
samples = APIRouter(prefix="/api/samples", tags=["inspections"])


@router.post("", status_code=201, responses=failures(errors.InvalidImport))
@operator
@of_projects
@heavy
def add(
    filename: Annotated[str, Query(min_length=1, max_length=1000, description="Name of the file.")],
    content: Annotated[
        bytes,
        Body(
            media_type="application/octet-stream",
            description="EN 13508-2 (text or XML), RIBX, ISYBAU, DWA-M 150, WinCan .db3 or the "
            "JSON report; the content determines the format.",
        ),
    ],
    inspections: Service[Inspections],
    imports: Service[Imports],
    principal: PrincipalDep,
    lang: Language = "en",
) -> ImportedOut:
    """Make an inspection, without a film, of every survey in the file, or of none if one cannot be
    stored; `lang` is the language of the warnings.
    """
    imported = imports.add(content, filename, principal)
    if not imported.inspection_ids:
        raise errors.InvalidImport(Translator(lang, "m").nothing_imported(imported.warnings))
    return _made(inspections, imported, lang)


@router.post(
    "/archive",
    status_code=201,
    responses=failures(
        errors.InvalidImport,
        errors.UploadNotFound,
        errors.UploadIncomplete,
        errors.UploadBusy,
        UnreadableVideo,
        RigVideoMismatch,
    ),
)
@operator
@of_projects
@heavy
def add_archive(
    body: ArchiveIn,
    inspections: Service[Inspections],
    imports: Service[Imports],
    principal: PrincipalDep,
    lang: Language = "en",
) -> ImportedOut:
    """Make an inspection of an uploaded archive file, with its photos and its film."""
    return _made(inspections, imports.add_archive(body.upload_id, principal), lang)


def _made(inspections: Inspections, imported: Imported, language: Language) -> ImportedOut:
    t = Translator(language, "m")
    views = [inspections.get(made) for made in imported.inspection_ids]
    return ImportedOut(
        inspections=[InspectionOut.of(view) for view in views],
        warnings=[t.caveat(caveat) for caveat in imported.warnings],
    )


@samples.get("")
@viewer
def state(sample: Service[Samples]) -> SampleOut:
    """Return the progress."""
    return SampleOut.of(sample.state())


@samples.post("", status_code=202, responses=failures(errors.SampleBeingMade))
@operator
def start(sample: Service[Samples]) -> SampleOut:
    """Start rendering in the background; an existing sample is `ready` at once."""
    return SampleOut.of(sample.start())
