"""Resumable uploads, tus 1.0.0 (https://tus.io/protocols/resumable-upload)."""

from __future__ import annotations

import base64
from email.utils import formatdate
from pathlib import PurePosixPath

from fastapi import APIRouter, Depends, Request, Response

from app import errors
from app.inspections.films.uploads import (
    CHECKSUMS,
    MAX_CHECKED_PIECE,
    Checksum,
    Uploads,
    UploadState,
    checksum_from,
)
from app.web.deps import PrincipalDep, Service, of_projects, operator
from app.web.schemas.failures import failures

TUS_VERSION = "1.0.0"
EXTENSIONS = "creation,expiration,termination,checksum"


def _require_version(request: Request) -> None:
    version = request.headers.get("tus-resumable")
    if version != TUS_VERSION:
        raise errors.UnsupportedTusVersion(
            f"Tus-Resumable must be {TUS_VERSION}; the request says {version or 'nothing'}."
        )


router = APIRouter(prefix="/api/uploads", tags=["uploads"])
_tus = Depends(_require_version)


@router.options("", status_code=204)
@router.options("/{upload_id}", status_code=204)
@operator
@of_projects
def options(uploads: Service[Uploads]) -> Response:
    """Return the tus features of this server."""
    return Response(
        status_code=204,
        headers={
            "Tus-Version": TUS_VERSION,
            "Tus-Extension": EXTENSIONS,
            "Tus-Max-Size": str(uploads.max_bytes),
            "Tus-Checksum-Algorithm": ",".join(CHECKSUMS),
        },
    )


@router.post(
    "",
    status_code=201,
    response_class=Response,
    dependencies=[_tus],
    responses=failures(
        errors.UnsupportedTusVersion,
        errors.InvalidUpload,
        errors.UploadTooLarge,
        errors.TooManyUploads,
    ),
)
@operator
@of_projects
def create(request: Request, uploads: Service[Uploads], principal: PrincipalDep) -> Response:
    """Announce a file: Upload-Length, and Upload-Metadata with its `filename`."""
    metadata = request.headers.get("upload-metadata", "")
    length = _number(request, "upload-length")
    upload_id = uploads.create(length, _file_name(metadata), metadata, principal.name)
    return Response(
        status_code=201,
        headers={
            "Location": f"/api/uploads/{upload_id}",
            **_expiry(uploads.state(upload_id)),
        },
    )


@router.head(
    "/{upload_id}",
    status_code=200,
    response_class=Response,
    dependencies=[_tus],
    responses=failures(errors.UnsupportedTusVersion, errors.UploadNotFound),
)
@operator
@of_projects
def look_up(upload_id: str, uploads: Service[Uploads]) -> Response:
    """Return the number of bytes on the disk."""
    state = uploads.state(upload_id)
    headers = {
        "Upload-Offset": str(state.offset),
        "Upload-Length": str(state.info.length),
        "Cache-Control": "no-store",
        **_expiry(state),
    }
    if state.info.metadata:
        headers["Upload-Metadata"] = state.info.metadata
    return Response(status_code=200, headers=headers)


@router.patch(
    "/{upload_id}",
    status_code=204,
    dependencies=[_tus],
    responses=failures(
        errors.UnsupportedTusVersion,
        errors.InvalidUpload,
        errors.UploadNotFound,
        errors.WrongContentType,
        errors.UploadTooLarge,
        errors.OffsetConflict,
        errors.UploadBusy,
        errors.ChecksumMismatch,
    ),
)
@operator
@of_projects
async def append(upload_id: str, request: Request, uploads: Service[Uploads]) -> Response:
    """Append bytes at Upload-Offset; the answer comes when they are on the disk."""
    kind = request.headers.get("content-type")
    if kind != "application/offset+octet-stream":
        raise errors.WrongContentType(
            f"The content type must be application/offset+octet-stream, not {kind or 'nothing'}."
        )
    checksum = _checksum(request)
    if checksum and int(request.headers.get("content-length") or 0) > MAX_CHECKED_PIECE:
        raise errors.UploadTooLarge(
            f"A piece with a checksum may have {MAX_CHECKED_PIECE} bytes at most."
        )
    offset = _number(request, "upload-offset")
    state = await uploads.append(upload_id, offset, request.stream(), checksum)
    return Response(status_code=204, headers={"Upload-Offset": str(state.offset), **_expiry(state)})


@router.delete(
    "/{upload_id}",
    status_code=204,
    dependencies=[_tus],
    responses=failures(errors.UnsupportedTusVersion, errors.UploadNotFound, errors.UploadBusy),
)
@operator
@of_projects
def terminate(upload_id: str, uploads: Service[Uploads]) -> Response:
    """Delete an upload and its bytes."""
    uploads.delete(upload_id)
    return Response(status_code=204)


def _number(request: Request, name: str) -> int:
    text = request.headers.get(name)
    if text is None or not (text.isascii() and text.isdigit() and len(text) <= 18):
        found = "is missing" if text is None else f"is {text[:40]!r}"
        raise errors.InvalidUpload(
            f"The header {name.title()} must be a whole number of bytes; it {found}."
        )
    return int(text)


def _expiry(state: UploadState) -> dict[str, str]:
    if state.offset == state.info.length:
        return {}
    return {"Upload-Expires": formatdate(state.expires_at, usegmt=True)}


def _checksum(request: Request) -> Checksum | None:
    text = request.headers.get("upload-checksum")
    if text is None:
        return None
    algorithm, _, digest = text.partition(" ")
    try:
        return checksum_from(algorithm, base64.b64decode(digest, validate=True))
    except ValueError as error:
        raise errors.InvalidUpload("Upload-Checksum must be `algorithm base64-digest`.") from error


def _file_name(metadata: str) -> str:
    """Return the user's name of the file, from `key base64,key base64,...`; only for display."""
    for pair in metadata.split(","):
        key, _, value = pair.strip().partition(" ")
        if key != "filename":
            continue
        try:
            name = base64.b64decode(value, validate=True).decode("utf-8")
        except ValueError as error:
            raise errors.InvalidUpload(
                "The filename of Upload-Metadata is not base64 of UTF-8."
            ) from error
        printable = "".join(c for c in name.replace("\\", "/") if c.isprintable())
        return PurePosixPath(printable).name[:255] or "video"
    return "video"
