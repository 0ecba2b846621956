"""What can go wrong in the server.

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

Each has a code, which programs rely on; `app.web.answers` knows the HTTP status of each.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Mapping
from typing import Any

from vo_core.errors import ChainageError


class AppError(ChainageError):
    """Base of the server's own errors; its text is a sentence for a person."""


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


class InvalidUpload(AppError):
    """A tus request without a header that it needs, or with an unreadable one."""


class UnsupportedTusVersion(AppError):
    """Tus-Resumable is missing or names another version."""


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

    code = "no_3d_view"


class Busy(AppError):
    """Too much is waiting already."""


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


_LONGEST_DETAIL = 4000
"""In characters."""


def code_of(kind: type[Exception]) -> str:
    """The name of an error that programs rely on: of InvalidRig invalid_rig."""
    return getattr(kind, "code", "") or re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()


def described(error: ChainageError) -> dict[str, str]:
    """Code and detail, as answers and pages have them."""
    return {"code": code_of(type(error)), "detail": shortened(str(error))}


def shortened(sentence: str) -> str:
    """What was sent may stand in it, and that may be long."""
    if len(sentence) <= _LONGEST_DETAIL:
        return sentence
    return f"{sentence[:_LONGEST_DETAIL]} ..."
