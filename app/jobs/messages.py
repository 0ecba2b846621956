"""Messages between parent and children, as msgpack.

A child that decodes hostile media must not be able to run code in the server. So the server
unpickles nothing: every message is decoded into these types and refused if it does not fit.
"""

from __future__ import annotations

from datetime import date
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from app.jobs.track.parts import Between, Mark

if TYPE_CHECKING:
    from vo_core.sources import Frame

MAX_MESSAGE_BYTES = 64 * 2**20


CornersPx = tuple[int, int, int, int]
"""A part of a picture: left, top, right, bottom; the last two are one past it."""


class Limits(msgspec.Struct, frozen=True, tag="limits"):
    """Limits that a child sets for itself before it opens any media."""

    memory_bytes: int
    cpu_s: int | None = None
    file_bytes: int = 0
    """Largest file that the child may write."""
    reads: tuple[str, ...] = ("/",)
    """Files and folders that the media process may read; other children derive theirs."""


class FrameRange(msgspec.Struct, frozen=True):
    """The frames of a chunk: a part of a film that is tracked by itself."""

    first: int
    """Number of the first frame."""
    end: int | None
    """Number of the frame after the last; None for the rest of the film."""
    shared: int
    """Number of frames that each of the chunks before and after it tracks too."""
    is_coarse: bool = False
    """Of the `Traits` that frames before it have shown, like the next."""
    is_noiseless: bool = False

    @property
    def name(self) -> str:
        """Name of the chunk, which it keeps when it goes on after its end."""
        return f"chunk-{self.first}" + "-coarse" * self.is_coarse + "-noiseless" * self.is_noiseless

    def holds(self, frame: Frame) -> bool:
        """Whether a frame of the film comes before the end of the chunk."""
        return self.end is None or frame.index < self.end


class Placed(msgspec.Struct, frozen=True):
    """Where the results of a chunk lie in those of the film."""

    first: int
    """First frame whose results come from the chunk."""
    x_mm: float
    """Added to its distances."""
    sigma_mm: float
    """Standard deviation of `x_mm`, as the shared frames show it."""
    columns: int
    """Pixels by which its wall is moved along the pipe."""
    rows: int
    """Pixels by which its wall is moved around the pipe."""


class TrackRequest(msgspec.Struct, frozen=True, tag="track"):
    """Parent to tracker: its one request."""

    video: str
    rig: dict[str, Any]
    limits: Limits
    pace: float | None = None
    """Most seconds of video tracked per second."""
    checkpoint: str | None = None
    """File of the `KeptCheckpoint` to resume from; None to begin with the first frame."""
    marks: list[Mark] = []
    """Marks of a camera's film."""
    frames: FrameRange | None = None
    """Frames to track, for a chunk; None for the whole film. Its results are for `chunks.join`."""


class CameraInput(msgspec.Struct, frozen=True):
    """An allowed live source, with the options for FFmpeg."""

    kind: Literal["rtsp", "mjpeg", "usb", "file", "pipe"]
    location: str
    """May contain a password: never shown, never logged."""
    options: dict[str, str] = {}
    peer: str | None = None
    """The only address to which connections are allowed."""


class LiveRequest(msgspec.Struct, frozen=True, tag="live"):
    """Parent to camera process: its one request, which runs until it is stopped."""

    camera: CameraInput
    rig: dict[str, Any]
    recording: str
    """File of the recording; an existing one is continued."""
    marks_file: str
    """Its parts.csv."""
    limits: Limits
    reserve_bytes: int
    """Disk space that the recording leaves free."""
    last: Row | None = None
    """Row of the last frame that the parent knows, if a recording is continued."""
    zero_s: float | None = None
    """Time 0 of that recording by `time.monotonic`, which all processes share."""
    left_out: list[Mark] = []
    """Frames up to `last` that are not recorded."""
    between: Between | None = None
    """The robot's movement, if a new part begins after `last`."""


class StopCapture(msgspec.Struct, frozen=True, tag="stop"):
    """Parent to camera process: end the recording, track what was captured, report done."""


class CameraState(msgspec.Struct, frozen=True, tag="camera"):
    """Camera process to parent, on every change and twice a second."""

    connected: bool
    reconnects: int
    dropped: int
    """Frames that were recorded but not tracked, since this process began."""
    recorded_s: float
    zero_s: float | None
    detail: str | None
    """A sentence that says why there is no picture."""
    is_recording: bool = True
    """False while the disk is full."""
    left_out: list[Mark] = []
    """Frames that were not recorded, since the previous state."""


class Row(msgspec.Struct, frozen=True, array_like=True):
    """An `Estimate` as a message."""

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
    looking_around: float = 0.0


class Gauged(msgspec.Struct, frozen=True, array_like=True):
    """The `Health` of a tracked frame as a message."""

    frame: int
    overlap: float
    brightness: float
    overexposed: float
    sharpness: float
    fixed_pattern: float


class Seen(msgspec.Struct, frozen=True, array_like=True):
    """A `Sighting` of a joint as a message."""

    frame: int
    ahead_mm: float
    sigma_mm: float
    contrast: float


class Tilted(msgspec.Struct, frozen=True, array_like=True):
    """A `MountTilt` as a message."""

    pitch_deg: float
    roll_deg: float
    pitch_sigma_deg: float
    roll_sigma_deg: float


class Standing(msgspec.Struct, frozen=True, array_like=True):
    """A `Stance` as a message."""

    y_mm: float
    yaw_deg: float
    z_mm: float
    pitch_deg: float
    roll_deg: float


class WallTile(msgspec.Struct, frozen=True, array_like=True):
    """The current picture of one tile of the unrolled wall."""

    index: int
    jpeg: bytes


class WallLayer(msgspec.Struct, frozen=True, array_like=True):
    """A tile of a chunk's own wall."""

    index: int
    png: bytes
    """Four channels: the picture, and how well each place was seen."""


class Tie(msgspec.Struct, frozen=True, array_like=True):
    """What the join of chunks needs of a frame beside its row."""

    frame: int
    systematic_mm: float
    """`Odometry.systematic_mm`."""
    bed_mm: float
    """`Odometry.bed_mm`."""
    picture: int
    """Checksum of the picture if two chunks track it, never 0; else 0."""
    is_coarse: bool
    """Of `Odometry.traits`, like the next."""
    is_noiseless: bool


class Batch(msgspec.Struct, frozen=True, tag="batch"):
    """Tracker to parent: the frames since the last batch, and the picture of the last of them."""

    rows: list[Row]
    jpeg: bytes
    captured_s: float | None = None
    """Time when the picture's frame came from its camera, by `time.monotonic`; None for files."""
    health: list[Gauged] = []
    """Health of the tracked frames; frames in between were left out."""
    tiles: list[WallTile] = []
    """Changed tiles of the unrolled wall."""
    sightings: list[Seen] = []
    """Joints that were detected."""
    tilt: Tilted | None = None
    """Tilt of the mount against the rig, from all frames so far."""
    stance: Standing | None = None
    """Where the camera stood at the first frame of the run; None while the newest part shows it
    worse than those before."""
    ties: list[Tie] = []
    """Of a chunk: one for each row."""
    start: Standing | None = None
    """Of a chunk: `Odometry.start`."""
    layers: list[WallLayer] = []
    """Of a chunk, in place of `tiles`: the tiles that it has left."""


class Checkpoint(msgspec.Struct, frozen=True, tag="checkpoint"):
    """Tracker to parent: the state from which another tracker can continue after these frames.

    All their results have been sent before.
    """

    frames: int
    """Number of the next frame; the frames of a chunk count from the beginning of the film."""
    cpu_s: float
    """Processor time used so far."""
    state: bytes
    """State of the `Follower`, pickled. Only a tracker may decode it: unpickling runs any code that
    the bytes name, and they come from a process that has decoded hostile media. In another tracker,
    under the same limits, such code gains nothing; in the server it would gain everything."""


class KeptCheckpoint(msgspec.Struct, frozen=True):
    """A checkpoint on the disk."""

    stamp: str
    """Identifies program, video and rig; the checkpoint fits no others."""
    journal_bytes: int
    """Length of the journal covered by the checkpoint."""
    checkpoint: Checkpoint


class Passing(msgspec.Struct, frozen=True, tag="passing"):
    """Tracker to parent, once a second: it is looking for the first frame of its chunk, or decoding
    the frames before its checkpoint again.
    """

    frames: int


class Done(msgspec.Struct, frozen=True, tag="done"):
    """Tracker to parent: the video has ended; `problem` says what was wrong with the file."""

    problem: str | None


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """Any child to parent: the request failed."""

    code: str
    detail: str
    trace: str = ""
    """For the server's log."""


class SampleRequest(msgspec.Struct, frozen=True, tag="sample"):
    """Parent to the process that renders the sample: its one request."""

    folder: str
    length_mm: float
    limits: Limits


class Rendered(msgspec.Struct, frozen=True, tag="rendered"):
    """Renderer to parent: frames done and the total."""

    done: int
    total: int


class CounterRequest(msgspec.Struct, frozen=True, tag="counter"):
    """Parent to the process that reads burnt-in counters: its one request."""

    video: str
    limits: Limits
    within: CornersPx | None = None
    """A part of the picture that holds the counter; without it, it is searched."""
    is_search: bool = False
    """Whether to find the counter only, and not to read it in every frame."""


class CounterAt(msgspec.Struct, frozen=True):
    """Where a counter stands and how it is written: a `CounterPlace`."""

    corners_px: CornersPx
    decimals: int
    unit: Literal["m", "ft", ""]
    has_fields: bool


class CounterProgress(msgspec.Struct, frozen=True, tag="counter_progress"):
    """Reader to parent: frames done, and the total if it is known."""

    done: int
    total: int | None


class CounterFound(msgspec.Struct, frozen=True, tag="counter_found"):
    """Reader to parent: where the counter stands in the film; the end of a search."""

    place: CounterAt | None
    film_date: date | None
    """Burnt into the film; None if it shows none."""
    width: int
    height: int
    """Of the picture."""


class CounterRead(msgspec.Struct, frozen=True, tag="counter_read"):
    """Reader to parent: the readings of all frames, as a table."""

    place: CounterAt | None
    film_date: date | None
    csv: str
    problem: str | None
    """What was wrong with the film."""


class JoinWallsRequest(msgspec.Struct, frozen=True, tag="join_walls"):
    """Parent to the process that joins the walls of chunks: its one request."""

    folders: list[str]
    """Of each chunk, the folder of its layers, `<index>.png`."""
    placed: list[Placed]
    rig: dict[str, Any]
    limits: Limits


class ProbeRequest(msgspec.Struct, frozen=True, tag="probe"):
    """Parent to media worker: probe this file."""

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
    pixel_aspect: float = 1.0


class FinaliseRequest(msgspec.Struct, frozen=True, tag="finalise"):
    """Parent to the finalising process: its one request."""

    recording: str
    target: str | None
    """MP4 file to write if the recording can be played in MP4; None if there is no room."""
    limits: Limits


class Finalised(msgspec.Struct, frozen=True, tag="finalised"):
    """The result of finalising; `target` exists if the container is MP4."""

    probed: Probed


class ReopenRequest(msgspec.Struct, frozen=True, tag="reopen"):
    """Parent to the process that turns a finished film back into a recording."""

    video: str
    recording: str
    """File to make; an existing one is replaced."""
    limits: Limits


class PictureRequest(msgspec.Struct, frozen=True, tag="picture"):
    """Parent to media worker: return the frame shown at this time, as JPEG."""

    video: str
    t_s: float
    jpeg_quality: int
    may_begin_anew: bool = False
    """Whether time stamps of the film may begin anew."""


class ReduceRequest(msgspec.Struct, frozen=True, tag="reduce"):
    """Parent to media worker: return a JPEG with this width, or as it is if it is smaller."""

    jpeg: bytes
    width: int
    jpeg_quality: int


class Picture(msgspec.Struct, frozen=True, tag="picture"):
    """Media worker to parent: the requested picture."""

    jpeg: bytes


class ClipRequest(msgspec.Struct, frozen=True, tag="clip"):
    """Parent to the process that cuts a clip: its one request."""

    video: str
    start_s: float
    """Presentation time of the first frame, or of one shortly before it."""
    end_s: float
    """Presentation time that no frame of the clip exceeds."""
    limits: Limits
    may_begin_anew: bool = False
    """Whether time stamps of the film may begin anew."""


class Clip(msgspec.Struct, frozen=True, tag="clip"):
    """Cutter to parent: the clip as an MP4 file."""

    mp4: bytes


class FirstPictureRequest(msgspec.Struct, frozen=True, tag="first_picture"):
    """Parent to media worker: return the first picture and the pipe's axis in it."""

    video: str
    jpeg_quality: int


class FirstPicture(msgspec.Struct, frozen=True, tag="first"):
    """Media worker to parent: the first picture of a video."""

    jpeg: bytes
    width: int
    height: int
    pixel_aspect: float
    axis_uv: tuple[float, float] | None
    """Pixel of the axis of the pipe along which the camera looks; None if it does not show."""


class FilmedBoard(msgspec.Struct, frozen=True):
    """The printed board of a film, and the lens that filmed it."""

    columns: int
    rows: int
    square_mm: float
    marker_mm: float | None
    """Side of a ChArUco board's markers; None for a checkerboard."""
    model: Literal["pinhole", "fisheye"]


class CalibrationRequest(msgspec.Struct, frozen=True, tag="calibrate"):
    """Parent to calibrator: measure the camera that filmed a board."""

    video: str
    board: FilmedBoard
    limits: Limits


class Calibrated(msgspec.Struct, frozen=True, tag="calibrated"):
    """Calibrator to parent: the camera, and how well it is known."""

    camera: dict[str, Any]
    focal_percent: float
    """Standard uncertainty of the focal length in percent."""
    pictures: int
    rms_px: float
    coverage: float
    """Share of the picture that the boards covered."""
    weaknesses: list[str]
    """What to do better; empty for a good calibration."""


FromCalibrator = Calibrated | Failed
FromTracker = Batch | Checkpoint | Passing | Done | Failed
ToCamera = LiveRequest | StopCapture
FromCamera = Batch | CameraState | Done | Failed
FromFinaliser = Finalised | Failed
FromReopener = Done | Failed
FromWallJoiner = Batch | Done | Failed
FromCounterReader = CounterProgress | CounterFound | CounterRead | Failed
FromClipper = Clip | Failed
FromSample = Rendered | Done | Failed
MediaRequest = ProbeRequest | PictureRequest | FirstPictureRequest | ReduceRequest
MediaAnswer = Probed | Picture | FirstPicture
ToMedia = Limits | MediaRequest
FromMedia = MediaAnswer | Failed

encode = msgspec.msgpack.Encoder().encode
