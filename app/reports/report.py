"""The report model, computed once, so that every format has the same distances."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from app.errors import BlobChanged, ExportNotAvailable, code_of
from app.inspections.counters import NO_COUNTER, CounterView
from app.reports.bundle.signing import Signer
from app.reports.content.words import Language
from app.reports.template import DEFAULT_TEMPLATE, ReportTemplate
from app.storage.blobs.blobs import Readable, StoredBlob, as_stored
from app.storage.database.tables import RemarkRow
from app.survey.adjustment.adjusted_track import BY_CAMERA, Adjusted
from app.survey.adjustment.adjusted_track import Source as DistanceSource
from app.survey.adjustment.joints import ExpectedJoint, FittedJoint
from app.survey.assets.register import Line
from app.survey.catalogue.ratings import Rating
from app.survey.catalogue.table import Code
from app.survey.distances.corrected import Corrected
from app.survey.distances.track_rows import is_unmeasured
from app.survey.findings.records import DetectorCount, Finding
from app.survey.observations.attachments import Attachment
from app.survey.observations.checks import Issue
from app.survey.observations.defects import is_defect
from app.survey.observations.records import Event
from app.survey.observations.review import DRAFT, ReviewState
from app.survey.observations.tag import StatedTag
from app.survey.places.measure import Figure
from vo_core import Rig, Track
from vo_core.errors import ChainageError
from vo_core.geometry.initial_pose import AS_STATED, InitialPose
from vo_core.joints.sightings import Sighting
from vo_core.mosaic.layout import Layout

if TYPE_CHECKING:
    from app.reports.content.marked_photo import MarkedPhoto

Units = Literal["m", "ft"]
Role = Literal["start", "change", "finish"]
CsvStyle = Literal["standard", "german"]
"""Comma and decimal point, or semicolon and decimal comma."""

_BLOCK = 2**20


@dataclass(frozen=True)
class Taken:
    """Where the camera was for a photo; all None until its frame is tracked."""

    time_s: float | None
    distance_m: float | None
    u95_m: float | None
    source: DistanceSource | None = None
    """Of the distance, like that of an entry."""


def says_source(at: Entry | Taken) -> bool:
    """Whether a distance needs a word about its source: it has an interval, and is not by the
    camera.
    """
    return at.u95_m is not None and at.source is not None and at.source not in BY_CAMERA


@dataclass(frozen=True)
class Photo:
    """The photo of an entry."""

    name: str
    """`<asset>-<number>.jpg`, equal in every format; any name in another program's survey."""
    jpeg: Readable | None
    """A blob that may be missing; None in an import, whose photos are elsewhere."""
    sha256: str | None
    """None for another program's photo."""
    marked: MarkedPhoto | None = None
    """A copy with the marks of a person, or a burnt-in caption."""
    of: str = ""
    """Id of the observation or the attachment that it is the photo of."""
    taken: Taken | None = None
    """Set where it shows another frame than the entry's, so that the entry's place is not its."""

    def time_s(self, entry: Entry) -> float | None:
        """Return its time in the film, as a photo of this entry."""
        return self.taken.time_s if self.taken else entry.time_s

    @property
    def original(self) -> Readable | None:
        """The file as it was taken: one that has changed since cannot be read."""
        return as_stored(self.jpeg, self.sha256) if self.jpeg else None

    @property
    def shown(self) -> Readable | None:
        """What reports show of it: the copy with marks if there is one."""
        return self.marked or self.original


@dataclass(frozen=True)
class VoiceNote:
    """What a person said about an entry."""

    name: str
    """`<asset>-<number>-<number of the note>.webm`, or another suffix."""
    sound: Readable
    """A blob that may be missing."""
    sha256: str | None
    of: str = ""
    """Id of the attachment."""

    @property
    def original(self) -> Readable:
        """The file as it was recorded: one that has changed since cannot be read."""
        return as_stored(self.sound, self.sha256)


@dataclass(frozen=True)
class Extras:
    """What a report shows only where it is asked for."""

    burnt_in: bool = False
    """Distance and code below each photo."""
    clip_of: Callable[[str], bytes] | None = None
    """Cuts the clip around an entry, by its id, as MP4; raises a ChainageError if it cannot."""
    film_path: str | None = None
    """Path of the film from the report's folder, such as `./film.mp4`: times of the report are then
    links; None: no film."""
    film_called: str | None = None
    """What exchange files call the film; None for its own name."""
    exchange: str | None = None
    """Exchange format of a delivery; None for EN 13508-2 text."""
    film: bool = False
    """The film in a delivery, and in the archive file."""
    photos: bool = False
    """Photos and voice notes, in the JSON report."""
    csv_style: CsvStyle = "standard"
    for_acceptance: bool = False
    """A mark on the pages and pictures of PDF and HTML, which then have no 3D view and history."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One observation as reported; None: unknown, as its place until its frame is tracked."""

    id: str
    seq: int
    """Number of the tag: it never changes, so that files and other programs can rely on it."""
    tag: StatedTag
    """What a person stated; everything else is derived from it, the track and the rig."""
    number: int = 0
    """What people call it: its place along the pipe in this report, from 1 (`along_the_pipe`)."""
    time_s: float | None = None
    """Time of the frame in the video."""
    distance_m: float | None = None
    """Corrected distance, to the millimetre."""
    u95_m: float | None = None
    raw_m: float | None = None
    """The same distance in the raw track."""
    source: DistanceSource | None = None
    """Basis of the distance: odometry, joint, closure, counter, bridged or typed."""
    to_go_m: float | None = None
    """Distance to the far end, if its distance is known."""
    joint_no: int | None = None
    at_joint: bool = False
    kind: Code | None
    """The row of the code pack; None for a code that is not in it."""
    clock_from: int | None
    """Clock position as entered, else from the pixel, in whole hours."""
    clock_h: float | None = None
    """Exact clock position from the pixel; None without one and on a floor."""
    cont_id: int | None
    """Number of its stretch."""
    cont_role: Role | None
    cont_length_m: float | None
    """Length of the stretch, given at its start once it is finished."""
    photo: Photo | None = None
    more_photos: tuple[Photo, ...] = ()
    """Further photos, and drawings on copies of photos, in the order of the person."""
    voice_notes: tuple[VoiceNote, ...] = ()
    figures: tuple[Figure | None, ...] = ()
    """Of the tag's measures, in their order; None where nothing can be derived."""
    x_m: float | None = None
    """The wall point: along the axis, right of it, below it (or below the camera's floor)."""
    y_m: float | None = None
    z_m: float | None = None
    lon: float | None = None
    lat: float | None = None
    tagged_by: str
    tagged_at: datetime
    edited_at: datetime | None
    edited_by: str | None

    @property
    def photos(self) -> tuple[Photo, ...]:
        """All its photos, the main one first."""
        return (self.photo, *self.more_photos) if self.photo else self.more_photos

    @property
    def counted_as(self) -> str:
        """The same for all parts of a stretch, which counts once."""
        return self.id if self.cont_id is None else f"stretch {self.cont_id}"

    @property
    def unit1(self) -> str | None:
        """Unit of `quant1`, by the code pack."""
        return self.kind.unit_q1 if self.kind and self.tag.quant1 is not None else None

    @property
    def unit2(self) -> str | None:
        """Unit of `quant2`, by the code pack."""
        return self.kind.unit_q2 if self.kind and self.tag.quant2 is not None else None

    def label(self, language: Language) -> str | None:
        """Return the meaning of the code, in the words of its pack."""
        if self.kind is None:
            return None
        return self.kind.label_in(language)


def along_the_pipe(entries: Iterable[Entry]) -> tuple[Entry, ...]:
    """Return the entries by distance, then by time, numbered; untracked ones come last."""

    def place(entry: Entry) -> tuple[float, float, int]:
        distance_m, time_s = (
            math.inf if value is None else value for value in (entry.distance_m, entry.time_s)
        )
        return distance_m, time_s, entry.seq

    return tuple(
        replace(entry, number=number) for number, entry in enumerate(sorted(entries, key=place), 1)
    )


@dataclass(frozen=True)
class Stretch:
    """A finished continuous defect."""

    number: int
    start: Entry
    changes: tuple[Entry, ...]
    finish: Entry


@dataclass(frozen=True)
class Source:
    """The film of the report."""

    kind: str
    """upload, live or import."""
    filename: str
    size: int
    sha256: str
    video: Mapping[str, Any]
    """Result of the probe: width, height, duration_s, frames, codec, playable, media_type."""


@dataclass(frozen=True)
class Company:
    """The company that issues the report."""

    name: str | None = None
    logo: Readable | None = None
    """PNG or JPEG."""
    address: str = ""
    """One or more lines, printed below the name."""
    server: str | None = None
    """Address at which people open its server; None where it is not set."""


@dataclass(frozen=True)
class Kept:
    """What an inspection takes along when it moves to another server, beside its report."""

    attachments: tuple[Attachment, ...] = ()
    remarks: tuple[RemarkRow, ...] = ()
    """What reviewers have said."""
    files: Mapping[str, StoredBlob] = field(default_factory=dict)
    """What else is known of the film, by the names of `app.imports.moved.archive_manifest`."""
    pack_table: str | None = None
    """The table of codes as CSV, if a person has added it."""
    findings: tuple[Finding, ...] = ()
    """What detectors proposed, with every decision."""


@dataclass(frozen=True, kw_only=True)
class Measured:
    """What was measured along the film of an inspection."""

    distance_m: float | None
    """Corrected distance of the last frame, like the next two fields."""
    u95_m: float | None
    raw_distance_m: float | None
    corrected: Corrected
    track: Track
    """The corrected track, one row for each frame."""
    raw_track: Track
    health: Mapping[str, NDArray[np.floating]]
    """Columns of the picture health by the fields of `Health`, one value for each frame so far."""
    sightings: tuple[Sighting, ...]
    """Joints that were seen while tracking, in the order of their frames."""
    wall: Mapping[int, Readable]
    """JPEG tiles of the unrolled wall by number, which counts raw distance (`Layout`)."""
    layout: Layout | None
    counter: CounterView = NO_COUNTER
    initial_pose: InitialPose = AS_STATED
    """Pose of the camera in the pipe at the first frame, against the rig's."""


@dataclass(frozen=True, kw_only=True)
class Report(Measured):
    """The report of an inspection in its present state."""

    id: str
    """Id of the inspection, and so of its report."""
    name: str
    status: str
    made_at: datetime
    created_at: datetime
    finished_at: datetime | None
    revision: int
    """Rises whenever a published distance changes."""
    header: Mapping[str, Any]
    """Values by the names of `app.survey.fields.header.FIELDS`; other names may occur too."""
    pack: str
    """Name of the table of codes."""
    ratings: tuple[Rating, ...] = ()
    """How that table grades an asset; empty: by the rule of the template."""
    rig: Rig
    source: Source
    entries: tuple[Entry, ...]
    """From `along_the_pipe`."""
    issues: tuple[Issue, ...]
    """Issues to resolve before the report is issued."""
    events: tuple[Event, ...]
    """Every change, the oldest first."""
    proposals: tuple[DetectorCount, ...] = ()
    """What became of the proposals of each detector."""
    labels: tuple[str, ...] = ()
    """The words by which people sort their inspections."""
    review: ReviewState = DRAFT
    reviewed_by: str | None = None
    """Who has set this state, and when; None while it is a draft."""
    reviewed_at: datetime | None = None
    tracked_with: str | None = None
    """Program that tracked the film, as `app.tracker` names it; None if that is not known."""
    warning: str | None = None
    error: str | None = None
    error_code: str | None = None
    company: Company = field(default_factory=Company)
    signer: Signer | None = None
    """Signs evidence bundles."""
    template: ReportTemplate = DEFAULT_TEMPLATE
    """Of its project."""
    film: StoredBlob | None = None
    """The film as it is stored; None while it is recorded, and where there is none."""
    scratch: Path | None = None
    """Folder on a disk for large files that are being written; None for the usual one."""
    line: Line = ()
    """Of the culvert on the map, by the register."""
    draw_scene: Callable[[Report], str] | None = None
    """Makes the page of the 3D view; raises a ChainageError if it cannot."""
    extras: Extras = field(default_factory=Extras)
    kept: Kept = field(default_factory=Kept)
    language: Language = "en"
    units: Units = "m"

    @property
    def asset(self) -> str:
        """Name of the culvert: the asset of the header, else the inspection."""
        return str(self.header.get("asset_id") or self.name)

    @property
    def date(self) -> str:
        """The day of the inspection as it was stated, else the one when it was created."""
        return str(self.header.get("date") or f"{self.created_at:%Y-%m-%d}")

    @property
    def template_in_force(self) -> ReportTemplate:
        """The template with the company that issues the report, which may be the server's."""
        return self.template.model_copy(update={"company_name": self.company.name or ""})

    def link_to(self, entry: Entry) -> str | None:
        """Return the address of the film at an entry; None where the server's is not known."""
        server = (self.company.server or "").rstrip("/")
        return f"{server}/inspections/{self.id}?defect={entry.id}" if server else None

    def film_at(self, time_s: float | None) -> str | None:
        """Return the link to a time in the film of the delivery; None without one."""
        path = self.extras.film_path
        if path is None or time_s is None:
            return None
        return f"{quote(path)}#t={time_s:.10g}"

    @property
    def adjusted(self) -> Adjusted | None:
        """The correction of the raw track; None where statements contradict each other."""
        return self.corrected.adjusted

    @property
    def is_unmeasured(self) -> bool:
        """Whether another program measured the distances, so that their uncertainty is unknown."""
        return len(self.raw_track) > 0 and is_unmeasured(self.raw_track)

    @property
    def joints(self) -> tuple[FittedJoint, ...]:
        """The joints of the pipe that were seen."""
        return self.adjusted.joints if self.adjusted else ()

    @property
    def joint_evidence(self) -> tuple[FittedJoint, ...]:
        """The seen joints with a seam at the zero and any before it, as the scale is based on
        them.
        """
        return self.adjusted.evidence if self.adjusted else ()

    @property
    def expected_joints(self) -> tuple[ExpectedJoint, ...]:
        """Places where joints are expected but were not seen."""
        return self.adjusted.expected_joints if self.adjusted else ()

    @property
    def defects(self) -> tuple[Entry, ...]:
        """The counted entries: a stretch counts once, where it is worst; the start and the end of
        the survey do not count unless somebody has rated them.
        """
        found: dict[str, Entry] = {}
        for entry in self.entries:
            if not is_defect(entry.tag.code, entry.tag.severity):
                continue
            known = found.setdefault(entry.counted_as, entry)
            if (entry.tag.severity or 0) > (known.tag.severity or 0):
                found[entry.counted_as] = entry
        kept = {entry.id for entry in found.values()}
        return tuple(entry for entry in self.entries if entry.id in kept)

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """The finished stretches, by number."""
        parts: dict[int, list[Entry]] = {}
        for entry in self.entries:
            if entry.cont_id is not None:
                parts.setdefault(entry.cont_id, []).append(entry)
        found = (_stretch(number, parts[number]) for number in sorted(parts))
        return tuple(stretch for stretch in found if stretch is not None)


class Phrase:
    """Words inside a sentence, which are translated with it."""

    def __init__(self, key: str, /, otherwise: str = "", **values: object) -> None:
        """Name the words.

        Args:
            key: Their key, such as `part.joints` or `field.client`.
            otherwise: What stands for them where no language has the key.
            values: As in `Loss`.
        """
        self.key = key
        self.otherwise = otherwise
        self.values = values


class Loss:
    """Something that a format cannot hold; `Translator.loss` makes a sentence of it."""

    def __init__(self, key: str, entry: Entry | None = None, /, **values: object) -> None:
        """Name what is lost.

        Args:
            key: Key of the sentence, without its area `loss`.
            entry: The entry that it concerns; its number is `{seq}` in the sentence.
            values: What the sentence contains: texts, numbers, phrases, or tuples of these.
        """
        self.key = key
        self.entry = entry
        self.values = values

    def in_format(self, kind: str) -> Loss:
        """Return the loss with the name of the format, for an archive of several."""
        return Loss("in_format", self.entry, format=format_name(kind), loss=self)


WhyLost = Literal["gone", "changed"]


def why_lost(error: FileNotFoundError) -> WhyLost:
    """Return how the key of a loss ends, by why a stored file could not be read."""
    return "changed" if isinstance(error, BlobChanged) else "gone"


def format_name(kind: str) -> Phrase:
    """Return the name of a format for people: of those of other programs, their own name."""
    return Phrase(f"format.{kind}", otherwise=kind.upper())


class FormatNeeds(ExportNotAvailable):
    """The inspection lacks what the format needs, which is said in every language."""

    code = code_of(ExportNotAvailable)

    def __init__(self, sentence: str, reason: Phrase) -> None:
        """Name what is lacking.

        Args:
            sentence: For programs, in English.
            reason: The same for people.
        """
        super().__init__(sentence)
        self.reason = reason


def failure(error: ChainageError) -> Phrase:
    """Return why something could not be made; in English where its code has no words."""
    if isinstance(error, FormatNeeds):
        return error.reason
    return Phrase(f"failure.{code_of(type(error))}", otherwise=str(error))


@dataclass(frozen=True)
class Written:
    """A report in one format."""

    content: bytes
    losses: tuple[Loss, ...] = ()
    file: IO[bytes] | None = None
    """Replaces `content` where that may not fit in memory: an open temporary file, at its start."""

    @property
    def size(self) -> int:
        """Size in bytes."""
        if self.file is None:
            return len(self.content)
        at = self.file.tell()
        end = self.file.seek(0, os.SEEK_END)
        self.file.seek(at)
        return end

    def blocks(self) -> Iterator[bytes]:
        """Yield the content once, then close the file."""
        if self.file is None:
            yield self.content
            return
        with self.file as file:
            while block := file.read(_BLOCK):
                yield block


def _stretch(number: int, entries: Sequence[Entry]) -> Stretch | None:
    def of(role: Role) -> list[Entry]:
        return [entry for entry in entries if entry.cont_role == role]

    starts, finishes = of("start"), of("finish")
    if not starts or not finishes:
        return None
    return Stretch(number, starts[0], tuple(of("change")), finishes[0])
