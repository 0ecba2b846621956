"""What can go wrong in the server, and the one place that knows status codes.

    vo_core.errors.ChainageError
    └── AppError
        ├── ...NotFound                                   nothing has that id
        ├── Unauthenticated, Forbidden, CrossOrigin, UnknownHost, TooManyAttempts access
        ├── InvalidUpload, OffsetConflict, UploadBusy, ChecksumMismatch, ...      uploads
        ├── FrameOutsideVideo, StillRunning, ChangedMeanwhile, ...                inspections
        ├── MediaFailed, MediaTimeout, Busy, DiskFull, NotReady, ...NotAvailable  not now, not yet
        ├── InvalidSettings, DataFolderInUse, UnusableDatabase, UnusableBackup,   before the start
        │   AddressNotAvailable, OpenToTheNetwork
        ├── TokenNameTaken, TokenNotFound, UnreadableTokens               `chainage token`
        └── UnreadableKey, UnusableBundle                                 bundles, `chainage verify`

Every failing answer has one body, `{"code": "snake_case", "detail": "a sentence for a person"}`.
"""

from __future__ import annotations

import errno
from collections.abc import Mapping
from typing import Any, ClassVar

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.websockets import WebSocket, WebSocketState

from app.logs import request_id
from vo_core.errors import (
    ChainageError,
    InvalidCorrection,
    InvalidRig,
    RigVideoMismatch,
    ShapeMismatch,
    UnreadableVideo,
)


class AppError(ChainageError):
    """Base of the server's own errors; its text is a sentence for a person."""

    headers: ClassVar[Mapping[str, str]] = {}


class InspectionNotFound(AppError):
    """No inspection has this id."""


class ObservationNotFound(AppError):
    """The inspection has no observation with this id."""


class UploadNotFound(AppError):
    """No upload has this id: never made, expired, or already an inspection."""


class PhotoNotFound(AppError):
    """The observation has no photo."""


class TileNotFound(AppError):
    """That piece of the wall was not seen."""


class FrameNotFound(AppError):
    """The inspection has no picture with this number, or it is not tracked yet."""


class WallNotSeen(AppError):
    """No frame shows this place of the wall."""


class IncompleteWallPoint(AppError):
    """A place on the wall without the coordinate around it."""


class Unauthenticated(AppError):
    """Neither a valid token nor a valid session came with the request."""

    headers: ClassVar[Mapping[str, str]] = {"WWW-Authenticate": "Bearer"}


class Forbidden(AppError):
    """The role of the token is not enough."""


class UnreadableTokens(AppError):
    """The file of the named tokens is damaged."""


class CrossOrigin(AppError):
    """The request was made by a page of another site."""


class UnknownHost(AppError):
    """The server is addressed by a name it does not answer to."""


class TooManyAttempts(AppError):
    """Too many failed log-ins from one address."""

    headers: ClassVar[Mapping[str, str]] = {"Retry-After": "60"}


class InvalidUpload(AppError):
    """A tus request without a header that it needs, or with an unreadable one."""


class UnsupportedTusVersion(AppError):
    """Tus-Resumable is missing or names another version."""

    headers: ClassVar[Mapping[str, str]] = {"Tus-Version": "1.0.0"}


class WrongContentType(AppError):
    """A PATCH that is not application/offset+octet-stream."""


class TooManyUploads(AppError):
    """One token has announced more files than it has used."""


class UploadTooLarge(AppError):
    """More bytes than announced, or than the server takes."""


class OffsetConflict(AppError):
    """The client and the disk disagree about what has arrived."""

    def __init__(self, offset: int) -> None:
        super().__init__(f"The server holds {offset} bytes of this upload; go on from there.")
        self.offset = offset


class ChangedMeanwhile(AppError):
    """What a change was made of is no longer what is stored."""

    def __init__(self, current: Mapping[str, Any] | None, yours: Mapping[str, Any]) -> None:
        """Of both in the form in which they are sent; `current` is None if it was deleted."""
        super().__init__("It was changed meanwhile, so nothing was stored; the answer has both.")
        self.current, self.yours = current, yours


class UploadBusy(AppError):
    """Another request is using the upload."""


class ChecksumMismatch(AppError):
    """The bytes that arrived are not those that were sent."""


NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
"""What the system answers to a write when the disk or the quota is full."""


class DiskFull(AppError):
    """There is no room for it on the server's disk."""

    def __init__(
        self, detail: str = "The server's disk is full. Free some room, then go on."
    ) -> None:
        super().__init__(detail)


class UploadIncomplete(AppError):
    """The upload has not arrived completely."""


class FrameOutsideVideo(AppError):
    """The video has no such frame."""


class PixelOutsidePicture(AppError):
    """The pixel is not in the picture."""


class LiveSourceRefused(AppError):
    """A live source that the server does not open."""


class OpenStretches(AppError):
    """A continuous defect was started and not finished."""


class NothingRecorded(AppError):
    """The live inspection has ended without a recording that could be tracked."""


class ExportNotAvailable(AppError):
    """The inspection lacks what the format needs; the text says what."""


class InvalidImport(AppError):
    """The file is no inspection that can be read; the text says what is wrong where."""


class PackNotFound(AppError):
    """No code pack has this id."""


class InvalidPack(AppError):
    """The file is no table of codes; the text says what is wrong in which line."""


class PackNameTaken(AppError):
    """Another code pack has this name."""


class PackInUse(AppError):
    """Inspections are coded with the pack."""


class SampleBeingMade(AppError):
    """The sample inspection is being made already."""


class SampleFailed(AppError):
    """The sample inspection could not be rendered."""


class NotAllTracked(AppError):
    """The track ends before the film, so nothing can be recorded behind it."""


class StillRunning(AppError):
    """The inspection must have ended for that."""


class NotRunning(AppError):
    """The inspection is not running, so there is nothing to stop."""


class MediaTimeout(AppError):
    """The media process took too long over one picture."""


class MediaFailed(AppError):
    """The media process died over this file."""


class NoScene(AppError):
    """The 3D view could not be started."""


class Busy(AppError):
    """Too much is waiting already."""

    headers: ClassVar[Mapping[str, str]] = {"Retry-After": "2"}


class NotReady(AppError):
    """A part of the server is not working; the text says which."""


class UnreadableKey(AppError):
    """The key that bundles are signed with is damaged, or may not be read."""


class UnusableBundle(AppError):
    """The file is no evidence bundle, so that nothing in it can be checked."""


class InvalidSettings(AppError):
    """A setting has a value that is not allowed."""


class DataFolderInUse(AppError):
    """Another server uses the data folder."""


class UnusableDatabase(AppError):
    """The file is damaged, or a newer version of Chainage made it."""


class UnusableBackup(AppError):
    """The archive is damaged or none of ours, or the place to restore to is not empty."""


class AddressNotAvailable(AppError):
    """The server cannot listen there: the port is in use, or the machine has no such address."""


class OpenToTheNetwork(AppError):
    """The server would listen for other machines without encryption, which nobody has allowed."""


class TokenNameTaken(AppError):
    """A valid token has this name."""


class TokenNotFound(AppError):
    """No valid token has this name."""


STATUS: dict[type[Exception], tuple[int, str]] = {
    InspectionNotFound: (404, "inspection_not_found"),
    ObservationNotFound: (404, "observation_not_found"),
    UploadNotFound: (404, "upload_not_found"),
    PhotoNotFound: (404, "photo_not_found"),
    FrameNotFound: (404, "frame_not_found"),
    TileNotFound: (404, "tile_not_found"),
    WallNotSeen: (404, "wall_not_seen"),
    PackNotFound: (404, "pack_not_found"),
    Unauthenticated: (401, "unauthenticated"),
    Forbidden: (403, "forbidden"),
    UnreadableTokens: (500, "unreadable_tokens"),
    UnreadableKey: (500, "unreadable_key"),
    CrossOrigin: (403, "cross_origin"),
    UnknownHost: (400, "unknown_host"),
    TooManyAttempts: (429, "too_many_attempts"),
    InvalidUpload: (400, "invalid_upload"),
    UnsupportedTusVersion: (412, "unsupported_tus_version"),
    WrongContentType: (415, "wrong_content_type"),
    TooManyUploads: (429, "too_many_uploads"),
    UploadTooLarge: (413, "upload_too_large"),
    OffsetConflict: (409, "offset_conflict"),
    ChangedMeanwhile: (412, "changed_meanwhile"),
    UploadBusy: (423, "upload_busy"),
    ChecksumMismatch: (460, "checksum_mismatch"),
    DiskFull: (507, "disk_full"),
    UploadIncomplete: (409, "upload_incomplete"),
    RigVideoMismatch: (422, "rig_video_mismatch"),
    FrameOutsideVideo: (422, "frame_outside_video"),
    PixelOutsidePicture: (422, "pixel_outside_picture"),
    LiveSourceRefused: (422, "live_source_refused"),
    OpenStretches: (409, "open_stretches"),
    NothingRecorded: (409, "nothing_recorded"),
    ExportNotAvailable: (409, "export_not_available"),
    InvalidImport: (422, "invalid_import"),
    InvalidPack: (422, "invalid_pack"),
    PackNameTaken: (409, "pack_name_taken"),
    PackInUse: (409, "pack_in_use"),
    SampleBeingMade: (409, "sample_being_made"),
    SampleFailed: (500, "sample_failed"),
    NotAllTracked: (409, "not_all_tracked"),
    StillRunning: (409, "still_running"),
    NotRunning: (409, "not_running"),
    MediaTimeout: (504, "media_timeout"),
    MediaFailed: (422, "media_failed"),
    NoScene: (503, "no_3d_view"),
    Busy: (503, "busy"),
    NotReady: (503, "not_ready"),
    IncompleteWallPoint: (422, "incomplete_wall_point"),
    InvalidCorrection: (422, "invalid_correction"),
    InvalidRig: (422, "invalid_rig"),
    UnreadableVideo: (422, "unreadable_video"),
    ShapeMismatch: (422, "shape_mismatch"),
}
"""Status and code of each error; a class that is not listed is looked up along its MRO."""

EVERYWHERE: dict[int, tuple[str, ...]] = {
    400: ("bad_request", "unknown_host"),
    401: ("unauthenticated",),
    403: ("cross_origin", "forbidden"),
    408: ("request_timeout",),
    413: ("body_too_large",),
    422: ("invalid_request",),
    500: ("internal_error",),
    503: ("busy",),
    507: ("disk_full",),
}
"""What any request may be answered with."""

_LONGEST_DETAIL = 4000
"""In characters."""

_HTTP_CODES = {
    400: ("bad_request", "The request cannot be understood."),
    404: ("not_found", "There is nothing at this address."),
    405: ("method_not_allowed", "This address does not take that method."),
    408: ("request_timeout", "The request did not arrive whole in time; send it again."),
    413: ("body_too_large", "The body of the request is too large."),
    416: ("range_not_satisfiable", "The file has no such range."),
}


def body_of(error: Exception) -> tuple[int, dict[str, str]]:
    """Status and body of the answer to `error`; anything unforeseen is a plain 500."""
    if isinstance(error, OSError) and error.errno in NO_ROOM:  # any write may end so
        error = DiskFull()
    for kind in type(error).__mro__:
        if kind in STATUS:
            status, code = STATUS[kind]
            return status, {"code": code, "detail": _bounded(str(error))}
    if isinstance(error, HTTPException):
        code, detail = _HTTP_CODES.get(error.status_code, ("request_refused", str(error.detail)))
        return error.status_code, {"code": code, "detail": detail}
    return 500, {
        "code": "internal_error",
        "detail": "The server met an unexpected fault. It is in the server's log"
        + (f" as {found}." if (found := request_id.get()) else "."),
    }


def _bounded(sentence: str) -> str:
    """What was sent may stand in it, and that may be long."""
    if len(sentence) <= _LONGEST_DETAIL:
        return sentence
    return f"{sentence[:_LONGEST_DETAIL]} ..."


def answer(error: Exception) -> JSONResponse:
    """The one error response."""
    status, body = body_of(error)
    content: dict[str, Any] = dict(body)
    if isinstance(error, ChangedMeanwhile):
        content |= {"current": error.current, "yours": error.yours}
    headers = dict(getattr(error, "headers", None) or {})
    if isinstance(error, OffsetConflict):
        headers["Upload-Offset"] = str(error.offset)
    return JSONResponse(content, status, headers)


_NOT_REPEATED = ("token", "source", "url")
"""Fields that may hold a password."""


def _validation_sentence(faults: Any) -> str:
    parts = []
    for fault in faults:
        if fault["type"] == "json_invalid":
            return f"The body is not JSON: {fault['ctx']['error']}."
        steps = (_legible(str(step)) for step in fault["loc"] if step != "body")
        where = ".".join(steps) or "the body"
        found = None if fault["loc"][-1] in _NOT_REPEATED else fault.get("input")
        shown = f" (found {found!r:.60})" if isinstance(found, str | int | float | bool) else ""
        message = str(fault["msg"]).removeprefix("Value error, ")
        parts.append(f"{where}: {message}{shown}")
    return _bounded("; ".join(parts) + ".")


def _legible(name: str) -> str:
    """A field's name, which a client may have made up."""
    return name[:60] if name.isprintable() else repr(name[:60])


async def _handle(connection: Request | WebSocket, error: Exception) -> Response:
    response = answer(error)
    if isinstance(connection, WebSocket):
        if connection.application_state is not WebSocketState.CONNECTING:
            raise error
        await connection.send_denial_response(response)
    return response


async def _handle_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)  # noqa: S101  (registered for this class only)
    return JSONResponse(
        {"code": "invalid_request", "detail": _validation_sentence(error.errors())}, 422
    )


def install(app: FastAPI) -> None:
    """Give `app` the one body for every error; `middleware.Envelope` has what passes through."""
    app.add_exception_handler(ChainageError, _handle)
    app.add_exception_handler(HTTPException, _handle)
    app.add_exception_handler(RequestValidationError, _handle_validation)
