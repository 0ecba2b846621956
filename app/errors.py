"""Errors of the server.

    vo_core.errors.ChainageError
    └── AppError
        ├── ...NotFound                                   nothing has that id
        ├── Unauthenticated, Forbidden, CrossOrigin, UnknownHost, TooManyAttempts access
        ├── InvalidUpload, OffsetConflict, UploadBusy, ChecksumMismatch, ...      uploads
        ├── FrameOutsideVideo, StillRunning, ChangedMeanwhile, DamagedTrack, ...  inspections
        ├── InspectionLocked, WrongReviewState, OpenQuestions                     the review
        ├── InvalidTable, FolderNotAllowed, NoSuchFilm, FilmChanged               the archive
        ├── MediaFailed, MediaTimeout, Busy, DiskFull, StoreUnavailable, NotReady,
        │   ...NotAvailable                                   not now, not yet
        ├── EngineUnavailable, WorkerLost, ClaimLost              tracking by several machines
        ├── InvalidSettings, DataFolderInUse, OtherServerActive, UnusableDatabase,  before
        │   UnusableBackup, AddressNotAvailable, OpenToTheNetwork                 the start
        ├── TokenNameTaken, TokenNotFound, UnreadableTokens               `chainage token`
        ├── ServerRefused, ServerAway                                     `chainage archive`
        └── UnreadableKey, UnusableBundle                                 bundles, `chainage verify`

Each has a code, which programs rely on, and states its HTTP status where it reaches a client.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Mapping, Sequence
from typing import Any

from vo_core.errors import (
    ChainageError,
    InvalidCorrection,
    InvalidRig,
    NoWallInView,
    RigVideoMismatch,
    ShapeMismatch,
    UnreadableVideo,
)

STATUS: dict[type[Exception], int] = dict.fromkeys(
    (
        InvalidCorrection,
        InvalidRig,
        NoWallInView,
        RigVideoMismatch,
        ShapeMismatch,
        UnreadableVideo,
    ),
    422,
)
"""HTTP status of each error; a class without one is answered as its nearest base that has one."""


class AppError(ChainageError):
    """Base of the server's own errors; its text is a sentence for a person."""

    def __init_subclass__(cls, status: int | None = None) -> None:
        super().__init_subclass__()
        if status is not None:
            STATUS[cls] = status


class CameraUnreachable(AppError, status=422):
    """A camera gives no picture; the text says why."""


class InspectionNotFound(AppError, status=404):
    """No inspection has this id."""


class ObservationNotFound(AppError, status=404):
    """The inspection has no observation with this id."""


class UploadNotFound(AppError, status=404):
    """No upload has this id: never made, expired, or already an inspection."""


class PhotoNotFound(AppError, status=404):
    """The observation has no photo."""


class AttachmentNotFound(AppError, status=404):
    """The observation has no attachment with this id, or its file is missing."""


class TooManyAttachments(AppError, status=409):
    """The observation has as many attachments as it may have."""


class BulkExportNotFound(AppError, status=404):
    """No bulk export has this id, or its archive is not made yet."""


class FeatureNotFound(AppError, status=404):
    """There is no such collection or feature of OGC API Features; the text says which."""


class InvalidQuery(AppError, status=400):
    """A parameter of OGC API Features is unknown or not understood; the text says which."""


class FindingNotFound(AppError, status=404):
    """The inspection has no finding with this id."""


class FindingDecided(AppError, status=409):
    """Somebody has decided otherwise about the finding."""


class DetectorNotFound(AppError, status=404):
    """No model of a user has this id."""


class DetectorNameTaken(AppError, status=409):
    """Another model has this name."""


class InvalidDetector(AppError, status=422):
    """The model, or its declaration, cannot be used; the text says what to do."""


class TileNotFound(AppError, status=404):
    """The part of the wall was not seen."""


class FrameNotFound(AppError, status=404):
    """The inspection has no picture with this number, or it is not tracked yet."""


class BlobNotFound(AppError, FileNotFoundError, status=404):
    """The store of films, photos, tiles and tracks has nothing under this key."""


class BlobChanged(BlobNotFound, status=404):
    """What lies in the store is not what was stored there, which is thereby lost."""


class DamagedTrack(AppError, status=409):
    """A file of the track cannot be read, or is missing."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"The track of this inspection is damaged: {reason} Track the film again; observations "
            "and corrections are kept."
        )


class IncompleteWallPoint(AppError, status=422):
    """A place on the wall lacks its coordinate around the wall."""


class Unauthenticated(AppError, status=401):
    """The request has no valid token or session."""


class Forbidden(AppError, status=403):
    """The role of the token is not sufficient."""


class UnreadableTokens(AppError, status=500):
    """The file of the named tokens is damaged."""


class CrossOrigin(AppError, status=403):
    """The request was made by a page of another site."""


class UnknownHost(AppError, status=400):
    """The request names the server by a host name that it does not accept."""


class TooManyAttempts(AppError, status=429):
    """Too many failed log-ins from one address."""


class InvalidUpload(AppError, status=400):
    """A tus request lacks a header or has an unreadable one."""


class UnsupportedTusVersion(AppError, status=412):
    """Tus-Resumable is missing or names another version."""


class WrongContentType(AppError, status=415):
    """The body is of another type than the route accepts."""


class TooManyUploads(AppError, status=429):
    """A token has announced too many uploads that it has not used."""


class UploadTooLarge(AppError, status=413):
    """More bytes than announced, or than the server accepts."""


class OffsetConflict(AppError, status=409):
    """The offsets of client and disk differ."""

    def __init__(self, offset: int) -> None:
        super().__init__(f"The server holds {offset} bytes of this upload; continue from there.")
        self.offset = offset


class ChangedMeanwhile(AppError, status=412):
    """The stored version is no longer the one that the change was based on."""

    def __init__(self, current: Mapping[str, Any] | None, yours: Mapping[str, Any] | None) -> None:
        """Store both versions as they are sent; None stands for deleted content."""
        super().__init__(
            "It was changed meanwhile, so nothing was stored; the answer contains both versions."
        )
        self.current, self.yours = current, yours


class UploadBusy(AppError, status=423):
    """Another request is using the upload."""


class ChecksumMismatch(AppError, status=460):
    """The received bytes differ from the checksum."""


NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
"""Errors of a write when the disk or the quota is full."""


class DiskFull(AppError, status=507):
    """There is not enough room on the server's disk."""

    def __init__(
        self, detail: str = "The server's disk is full. Free some space, then continue."
    ) -> None:
        super().__init__(detail)


class StoreUnavailable(AppError, status=503):
    """The object store does not answer, refuses the credentials, or has no such bucket."""


class UploadIncomplete(AppError, status=409):
    """The upload is not complete."""


class FrameOutsideVideo(AppError, status=422):
    """The video has no such frame."""


class PixelOutsidePicture(AppError, status=422):
    """The pixel is not in the picture."""


class LiveSourceRefused(AppError, status=422):
    """The server does not open this live source."""


class OpenStretches(AppError, status=409):
    """A continuous defect was started and not finished."""


class NothingRecorded(AppError, status=409):
    """The live inspection has ended without a recording that could be tracked."""


class ExportNotAvailable(AppError, status=409):
    """The inspection, or the server, lacks what the format needs; the text says what."""


class InvalidRequest(AppError, status=422):
    """The request has a value that does not fit what is stored."""


class InvalidImport(AppError, status=422):
    """The file contains no inspection that can be read; the text says what is wrong and where."""


class InvalidTable(AppError, status=422):
    """A table of films or assets cannot be read; the text says what is wrong in which line."""


class FolderNotAllowed(AppError, status=422):
    """The path is not in a folder from which films may be added."""


class NoSuchFilm(AppError, status=422):
    """There is nothing at the path, or it cannot be read."""


class FilmMissing(AppError):
    """The file of a film of the archive is not there any more, or cannot be read."""


class FilmChanged(AppError):
    """The file of a film of the archive is not the one that was added."""


class NoLongerWanted(AppError):
    """The film was paused, cancelled or taken off the list while it was being taken in."""


class PackNotFound(AppError, status=404):
    """No code pack has this id."""


class InvalidPack(AppError, status=422):
    """The file is not a table of codes; the text says what is wrong in which line."""

    def __init__(self, text: str, faults: Sequence[str] = ()) -> None:
        super().__init__(text)
        self.faults = tuple(faults) or (text,)
        """All that is wrong, where the text names the first."""


class PackNameTaken(AppError, status=409):
    """Another code pack has this name."""


class AssetNotFound(AppError, status=404):
    """The register has no asset with this id."""


class RigNotFound(AppError, status=404):
    """No rig of the library has this id."""


class RigNameTaken(AppError, status=409):
    """Another rig of the library has this name."""


class InvalidCalibration(AppError, status=422):
    """A film of a board does not determine a camera; the text says what to do."""


class PackInUse(AppError, status=409):
    """An inspection uses the pack."""


class SampleBeingMade(AppError, status=409):
    """The sample inspection is being made already."""


class SampleFailed(AppError, status=500):
    """The sample inspection could not be rendered."""


class NotAllTracked(AppError, status=409):
    """The track ends before the film, so the recording cannot be continued."""


class StillRunning(AppError, status=409):
    """The inspection is still running."""


class InspectionLocked(AppError, status=409):
    """The inspection is approved, so nobody changes it until it is reopened."""


class WrongReviewState(AppError, status=409):
    """The state of the review cannot directly follow the present one."""


class OpenQuestions(AppError, status=409):
    """A reviewer's question about a defect is not settled."""


class RemarkNotFound(AppError, status=404):
    """The inspection has no remark with this id."""


class LinkNotFound(AppError, status=404):
    """No valid link has this secret: it never had one, has expired, or was revoked."""


class DeliveryChanged(AppError, status=409):
    """The inspection is no longer as the client saw it."""


class TooManyAnswers(AppError, status=409):
    """A section has as many answers of one link as it may have."""


class AnswerNotFound(AppError, status=404):
    """The inspection has no answer of a client with this id."""


class WorkOrderNotFound(AppError, status=404):
    """No work order has this id."""


class WorkOrderExists(AppError, status=409):
    """Another work order has this number and this asset."""


class WorkOrderEnded(AppError, status=409):
    """The work order is closed or cancelled."""


class IdempotencyKeyReused(AppError, status=422):
    """Another request was sent with the same Idempotency-Key."""


class NotRunning(AppError, status=409):
    """The inspection is not running, so there is nothing to stop."""


class NothingToMeasureBy(AppError, status=409):
    """The wall of an earlier survey offers no correction, or another one than the person saw."""


class MediaTimeout(AppError, status=504):
    """The media process took too long over one picture."""


class MediaFailed(AppError, status=422):
    """The media process died over this file."""


class NoScene(AppError, status=503):
    """The 3D view could not be started."""

    code = "no_3d_view"


class Busy(AppError, status=503):
    """Too many requests are already waiting."""


class EngineUnavailable(AppError, status=503):
    """The cluster that tracks films cannot be reached."""


class WorkerLost(AppError, status=503):
    """A worker of the cluster was lost with its run, which another worker can do again."""


class ClaimLost(AppError, status=409):
    """A newer run of the inspection has begun, so this result is not used."""


class NotReady(AppError, status=503):
    """A part of the server is not working; the text says which."""


class UnreadableKey(AppError, status=500):
    """The signing key of bundles is damaged or not readable."""


class UnusableBundle(AppError):
    """The file is not an evidence bundle, so nothing in it can be checked."""


class InvalidSettings(AppError):
    """A setting has a value that is not allowed."""


class DataFolderInUse(AppError):
    """Another server uses the data folder."""


class OtherServerActive(AppError):
    """Another server is the active one of the database."""


class UnusableDatabase(AppError):
    """The file is damaged, or a newer version of Chainage made it."""


class UnusableBackup(AppError):
    """The archive is damaged or foreign, or the place to restore to is not empty."""


class AddressNotAvailable(AppError):
    """The server cannot listen there: the port is in use, or the machine has no such address."""


class OpenToTheNetwork(AppError):
    """Other machines could reach the server without encryption, which no setting allows."""


class ServerRefused(AppError):
    """A server has refused the request of a command; the text is its sentence."""


class ServerAway(ServerRefused):
    """A server does not answer now, or lacks what it needs, such as its database."""

    def __init__(self, text: str, pause_s: float = 0.0) -> None:
        """Store the sentence, and the pause that the server asks for."""
        super().__init__(text)
        self.pause_s = pause_s


class TokenNameTaken(AppError, status=409):
    """A valid token has this name."""


class TokenNotFound(AppError, status=404):
    """No valid token has this name."""


_LONGEST_DETAIL = 4000
"""Longest detail, in characters."""


def code_of(kind: type[Exception]) -> str:
    """Return the code of an error, on which programs rely: `invalid_rig` for InvalidRig."""
    return getattr(kind, "code", "") or re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()


def described(error: ChainageError) -> dict[str, str]:
    """Return code and detail of an error, as in answers and on pages."""
    return {"code": code_of(type(error)), "detail": shortened(str(error))}


def shortened(sentence: str) -> str:
    """Shorten a sentence, which may contain long input."""
    if len(sentence) <= _LONGEST_DETAIL:
        return sentence
    return f"{sentence[:_LONGEST_DETAIL]} ..."
