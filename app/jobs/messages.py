"""What parent and children say to each other, as msgpack.

A child that decodes hostile media must not be able to run code in the server, so it unpickles
nothing: every message is decoded into these types and refused if it does not fit.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from app.jobs.parts import Between, Mark

MAX_MESSAGE_BYTES = 64 * 2**20


class Limits(msgspec.Struct, frozen=True, tag="limits"):
    """What a child may use, set by itself before it touches any media."""

    memory_bytes: int
    cpu_s: int | None = None
    file_bytes: int = 0
    """Largest file that it may write."""
    reads: tuple[str, ...] = ("/",)
    """Files and folders that the media process may read; the others know what they need."""


class TrackRequest(msgspec.Struct, frozen=True, tag="track"):
    """Parent to tracker: the one thing it is to do."""

    video: str
    rig: dict[str, Any]
    limits: Limits
    pace: float | None = None
    """At most so many seconds of video a second."""
    checkpoint: str | None = None
    """File of the `KeptCheckpoint` from which it goes on; None to begin with the first frame."""
    marks: list[Mark] = []
    """Of a film of a camera."""


class CameraInput(msgspec.Struct, frozen=True):
    """A live source that was found to be allowed, as FFmpeg is to open it."""

    kind: Literal["rtsp", "mjpeg", "usb", "file", "pipe"]
    location: str
    """May hold a password: never shown, never logged."""
    options: dict[str, str] = {}
    peer: str | None = None
    """The one address that may be talked to."""


class LiveRequest(msgspec.Struct, frozen=True, tag="live"):
    """Parent to camera process: the one thing it is to do, until it has to stop."""

    camera: CameraInput
    rig: dict[str, Any]
    recording: str
    """File; if it exists, it is gone on with."""
    marks_file: str
    """Its parts.csv."""
    limits: Limits
    reserve_bytes: int
    """Disk space that the recording leaves free."""
    last: Row | None = None
    """Of the last frame that the parent knows, where a recording is gone on with."""
    zero_s: float | None = None
    """Time 0 of that recording on the clock `time.monotonic`, which all processes share."""
    left_out: list[Mark] = []
    """Frames until `last` that are not recorded."""
    between: Between | None = None
    """A new part begins behind `last`."""


class StopCapture(msgspec.Struct, frozen=True, tag="stop"):
    """Parent to camera process: end the recording, track what was captured, say done."""


class CameraState(msgspec.Struct, frozen=True, tag="camera"):
    """Camera process to parent, on every change and twice a second."""

    connected: bool
    reconnects: int
    dropped: int
    """Frames that are recorded but were not tracked, since this process began."""
    recorded_s: float
    zero_s: float | None
    detail: str | None
    """Why there is no picture, in a sentence."""
    is_recording: bool = True
    """False while the disk is full."""
    left_out: list[Mark] = []
    """Frames that were not recorded, since the state before."""


class Row(msgspec.Struct, frozen=True, array_like=True):
    """An `Estimate` on its way."""

    frame: int
    time_s: float
    x_mm: float
    y_mm: float
    yaw_deg: float
    distance_mm: float
    sigma_distance_mm: float
    quality: float
    status: Literal["ok", "weak", "lost"]
    sigma_registration_mm: float
    z_mm: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0


class Gauged(msgspec.Struct, frozen=True, array_like=True):
    """`Health` of a tracked frame on its way."""

    frame: int
    overlap: float
    brightness: float
    overexposed: float
    sharpness: float
    fixed_pattern: float


class Seen(msgspec.Struct, frozen=True, array_like=True):
    """A `Sighting` of a joint on its way."""

    frame: int
    ahead_mm: float
    sigma_mm: float
    contrast: float


class Tilted(msgspec.Struct, frozen=True, array_like=True):
    """A `MountTilt` on its way."""

    pitch_deg: float
    roll_deg: float
    pitch_sigma_deg: float
    roll_sigma_deg: float


class WallTile(msgspec.Struct, frozen=True, array_like=True):
    """A piece of the unrolled wall, as it is now."""

    index: int
    jpeg: bytes


class Batch(msgspec.Struct, frozen=True, tag="batch"):
    """Tracker to parent: the frames since the last batch, and the picture of the last of them."""

    rows: list[Row]
    jpeg: bytes
    captured_s: float | None = None
    """When the frame of the picture came from its camera, by `time.monotonic`; None for files."""
    health: list[Gauged] = []
    """Of the frames that were tracked; those in between were left out."""
    tiles: list[WallTile] = []
    """Pieces of the unrolled wall that changed."""
    sightings: list[Seen] = []
    """Joints that were found."""
    tilt: Tilted | None = None
    """Of the mount against the rig, by all frames until now."""


class Checkpoint(msgspec.Struct, frozen=True, tag="checkpoint"):
    """Tracker to parent: what another tracker needs to go on behind these frames.

    All that was found in them has been sent before it.
    """

    frames: int
    cpu_s: float
    """Processor time that they took."""
    state: bytes
    """Of the `Follower`, pickled.  Only a tracker may decode it: unpickling runs whatever code the
    bytes name, and they come from a process that has decoded hostile media.  In another tracker,
    under the same limits, such code gains nothing; in the server it would have everything."""


class KeptCheckpoint(msgspec.Struct, frozen=True):
    """A checkpoint on the disk."""

    stamp: str
    """Of the program, the video and the rig that it was made with; it fits no other."""
    journal_bytes: int
    """How much of the journal belongs to it."""
    checkpoint: Checkpoint


class Passing(msgspec.Struct, frozen=True, tag="passing"):
    """Tracker to parent, once a second: it decodes the frames before its checkpoint once more."""

    frames: int


class Done(msgspec.Struct, frozen=True, tag="done"):
    """Tracker to parent: the video has ended; `problem` says what was wrong with the file."""

    problem: str | None


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """Either child to parent: it cannot be done."""

    code: str
    detail: str
    trace: str = ""
    """For the server's log."""


class SampleRequest(msgspec.Struct, frozen=True, tag="sample"):
    """Parent to the process that renders the sample: the one thing it is to do."""

    folder: str
    length_mm: float
    limits: Limits


class Rendered(msgspec.Struct, frozen=True, tag="rendered"):
    """Renderer to parent: frames done and frames in all."""

    done: int
    total: int


class ProbeRequest(msgspec.Struct, frozen=True, tag="probe"):
    """Parent to media worker: what is this file?"""

    video: str


class Probed(msgspec.Struct, frozen=True, tag="probed"):
    """Media worker to parent: `VideoInfo`."""

    width: int
    height: int
    codec: str
    container: str
    pixel_format: str | None
    frames: int | None
    duration_s: float | None
    rate_hz: float | None


class FinaliseRequest(msgspec.Struct, frozen=True, tag="finalise"):
    """Parent to the process that makes a recording fit for review."""

    recording: str
    target: str | None
    """MP4 file to write if the recording can be played in one; None if there is no room."""
    limits: Limits


class Finalised(msgspec.Struct, frozen=True, tag="finalised"):
    """What has become of the recording; `target` is there if the container is MP4."""

    probed: Probed


class ReopenRequest(msgspec.Struct, frozen=True, tag="reopen"):
    """Parent to the process that makes a finished film a recording again."""

    video: str
    recording: str
    """File to make; one that is there is replaced."""
    limits: Limits


class PictureRequest(msgspec.Struct, frozen=True, tag="picture"):
    """Parent to media worker: the frame shown at this time, as JPEG."""

    video: str
    t_s: float
    jpeg_quality: int


class Picture(msgspec.Struct, frozen=True, tag="picture"):
    """Media worker to parent."""

    jpeg: bytes


FromTracker = Batch | Checkpoint | Passing | Done | Failed
ToCamera = LiveRequest | StopCapture
FromCamera = Batch | CameraState | Done | Failed
FromFinaliser = Finalised | Failed
FromReopener = Done | Failed
FromSample = Rendered | Done | Failed
ToMedia = Limits | ProbeRequest | PictureRequest
FromMedia = Probed | Picture | Failed

encode = msgspec.msgpack.Encoder().encode
