"""What happens on one server of a database is shown on the others as it happens.

Events of this server go to the others, and theirs to the listeners here.  A run of another server
is mirrored: its track grows here too, from the same batches, so that distances, the live picture
and the 3D view are the same on every server.  Only the server of a run writes its files.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import msgspec

from app.errors import InspectionNotFound
from app.jobs.track.batches import Batch
from app.storage.database.tables import ENDED
from app.storage.members import Members
from app.storage.records.inspections import InspectionStore
from app.tracking.films.runs import Run, RunElsewhere, Runs
from app.tracking.live import (
    CameraStatus,
    DistancesCorrected,
    Event,
    Listener,
    Live,
    ObservationsChanged,
    Progress,
    Update,
    WallChanged,
)
from app.tracking.tracks import HEALTH, Tracks
from vo_core.image.health import Health
from vo_core.track import COLUMNS, Estimate, Track

_ASK_EVERY_S = 1.0
_ROWS_AT_ONCE = 5_000
"""Rows of one message when a whole track is sent."""


class _Hello(msgspec.Struct, frozen=True, tag="hello"):
    """Asks the others for their runs."""

    sender: str


class _Began(msgspec.Struct, frozen=True, tag="began"):
    """A run has begun, or all of its rows follow."""

    inspection_id: str
    camera: CameraStatus | None
    to: str | None = None
    """The server that has asked; None: all."""


class _Took(msgspec.Struct, frozen=True, tag="took"):
    """Results of a run."""

    inspection_id: str
    first: int
    """Number of its rows before."""
    batch: Batch
    camera: CameraStatus | None
    to: str | None = None


class _Stated(msgspec.Struct, frozen=True, tag="stated"):
    """An inspection has this state."""

    inspection_id: str
    state: str
    progress: Progress
    camera: CameraStatus | None


class _Observed(msgspec.Struct, frozen=True, tag="observed"):
    inspection_id: str


class _Corrected(msgspec.Struct, frozen=True, tag="corrected"):
    inspection_id: str


class _Wall(msgspec.Struct, frozen=True, tag="wall"):
    inspection_id: str
    indices: tuple[int, ...]


class _Stop(msgspec.Struct, frozen=True, tag="stop"):
    """Asks the server of a run to stop it."""

    inspection_id: str
    why: str


_Message = _Hello | _Began | _Took | _Stated | _Observed | _Corrected | _Wall | _Stop
_decoder: msgspec.msgpack.Decoder[_Message] = msgspec.msgpack.Decoder(_Message)


class Relay:
    """Sends the events of this server, and publishes those of the others here."""

    def __init__(
        self,
        members: Members,
        inspections: InspectionStore,
        tracks: Tracks,
        runs: Runs,
        live: Live,
        forget: Callable[[str | None], None],
    ) -> None:
        """Store what is needed; `runs.follow` and a listener of `live` have to be set to this.

        Args:
            members: The servers of the database.
            inspections: Their rows.
            tracks: The tracks, also of mirrored runs.
            runs: The runs, also the mirrored ones.
            live: The events of this server.
            forget: Drops what is kept of an inspection beside its track (None: of all), as another
                server has changed it.
        """
        self._members = members
        self._inspections = inspections
        self._tracks = tracks
        self._runs = runs
        self._live = live
        self._forget = forget
        self._sending = threading.RLock()
        """Held so that no batch comes between the parts of a track."""
        self._asked_s = 0.0
        self._receiver: int | None = None
        """The thread in which the events of the others are published."""

    def on_event(self, event: Event) -> None:
        """Send an event to the others, unless it came from them."""
        if threading.get_ident() == self._receiver:
            return
        is_over = isinstance(event, Update) and event.state != "running"
        if is_over and self._runs.mirrored(event.inspection_id) is not None:
            self._end(event.inspection_id)  # its server has died
        match event:
            case Update(estimates=()):  # others have their results by `took`
                self._send(_Stated(event.inspection_id, event.state, event.progress, event.camera))
            case ObservationsChanged(inspection_id):
                self._send(_Observed(inspection_id))
            case DistancesCorrected(inspection_id):
                self._send(_Corrected(inspection_id))
            case WallChanged(inspection_id, indices):
                self._send(_Wall(inspection_id, indices))

    def of_here(self, listener: Listener) -> Listener:
        """Return a listener for the events of this server only: the others do their own work."""

        def listen(event: Event) -> None:
            if threading.get_ident() != self._receiver:
                listener(event)

        return listen

    def began(self, run: Run) -> None:
        """Send that a run has begun, with the rows that it has already."""
        self._send_whole(run, None)

    def took(self, run: Run, first: int, batch: Batch) -> None:
        """Send the results of a run; its tiles are files that every server reads."""
        batch = msgspec.structs.replace(batch, tiles=[], captured_s=None)
        with self._sending:
            self._send(_Took(run.inspection.id, first, batch, run.camera))

    def reset(self) -> None:
        """Forget what others may have changed, and ask them for their runs."""
        self._receiver = threading.get_ident()
        for inspection_id in self._runs.elsewhere():
            self._end(inspection_id)
        self._tracks.forget_finished()
        self._forget(None)
        self._ask()

    def receive(self, content: bytes) -> None:
        """Handle a message of another server."""
        self._receiver = threading.get_ident()
        match _decoder.decode(content):
            case _Hello(sender):
                for run in self._runs.here():
                    self._send_whole(run, sender)
            case _Began(inspection_id, camera, to):
                if to in (None, self._members.name):
                    self._mirror(inspection_id, camera)
            case _Took() as took:
                if took.to in (None, self._members.name):
                    self._take(took)
            case _Stated(inspection_id, state, progress, camera):
                self._note(inspection_id, state, progress, camera)
            case _Observed(inspection_id):
                self._live.observations_changed(inspection_id)
            case _Corrected(inspection_id):
                self._forget(inspection_id)
                self._live.corrected(inspection_id)
            case _Wall(inspection_id, indices):
                self._live.wall_changed(inspection_id, indices)
            case _Stop(inspection_id, why):
                if self._is_here(inspection_id):
                    self._runs.ask_to_stop(inspection_id, why)

    def _mirror(self, inspection_id: str, camera: CameraStatus | None) -> None:
        try:
            row = self._inspections.get(inspection_id)
        except InspectionNotFound:
            return
        self._forget(inspection_id)
        stop = _Stopper(self._send, inspection_id)
        self._runs.mirror(RunElsewhere(row, camera=camera, ask_its_server=stop))

    def _take(self, took: _Took) -> None:
        run = self._runs.mirrored(took.inspection_id)
        known = len(self._tracks.get(took.inspection_id))
        if self._is_here(took.inspection_id):  # it was taken over from the sender
            return
        if run is None or took.first > known:
            # Something was missed; its server sends all of it.
            if time.monotonic() > self._asked_s + _ASK_EVERY_S:
                self._ask()
        elif took.first == known:
            run.camera = took.camera
            self._runs.take(run, took.batch)

    def _note(
        self, inspection_id: str, state: str, progress: Progress, camera: CameraStatus | None
    ) -> None:
        run = self._runs.mirrored(inspection_id)
        if state != "running":
            self._end(inspection_id)
            self._forget(inspection_id)
        elif run is not None:
            run.camera, run.fps = camera, progress.fps
        if state in ENDED or run is not None or state == "queued":
            self._live.publish(inspection_id, state, progress, camera=camera)

    def _end(self, inspection_id: str) -> None:
        """End the mirrored run; from now on the track is that of the files."""
        if not self._is_here(inspection_id):
            self._tracks.forget(inspection_id)
            self._runs.end_mirrored(inspection_id)

    def _ask(self) -> None:
        self._asked_s = time.monotonic()
        self._send(_Hello(self._members.name))

    def _is_here(self, inspection_id: str) -> bool:
        return any(run.inspection.id == inspection_id for run in self._runs.here())

    def _send_whole(self, run: Run, to: str | None) -> None:
        inspection_id = run.inspection.id
        with self._sending:
            self._send(_Began(inspection_id, run.camera, to))
            first = 0
            for batch in batches_of(self._tracks, inspection_id):
                self._send(_Took(inspection_id, first, batch, run.camera, to))
                first += len(batch.estimates)

    def _send(self, message: _Message) -> None:
        self._members.send(msgspec.msgpack.encode(message))


class _Stopper:
    """Asks the server of a run to stop it."""

    def __init__(self, send: Callable[[_Message], None], inspection_id: str) -> None:
        self._send = send
        self._inspection_id = inspection_id

    def __call__(self, why: str) -> None:
        self._send(_Stop(self._inspection_id, why))


def batches_of(tracks: Tracks, inspection_id: str) -> list[Batch]:
    """Return what is known of a growing track as the batches of its tracker, without pictures."""
    track, health = tracks.get(inspection_id), tracks.health(inspection_id).columns()
    tilt, stance = tracks.tilt(inspection_id), tracks.stance(inspection_id)
    gauged = [
        (frame, Health(*map(float, values)))
        for frame, values in enumerate(zip(*(health[name] for name in HEALTH), strict=True))
    ]
    batches = [
        Batch(_estimates(track, first), health=gauged[first : first + _ROWS_AT_ONCE])
        for first in range(0, len(track), _ROWS_AT_ONCE)
    ]
    if batches:
        batches[-1] = msgspec.structs.replace(
            batches[-1],
            sightings=tracks.sightings(inspection_id),
            tilt=tilt,
            stance=stance,
        )
    return batches


def _estimates(track: Track, first: int) -> list[Estimate]:
    names = COLUMNS
    columns = [getattr(track, name)[first : first + _ROWS_AT_ONCE].tolist() for name in names]
    return [Estimate(*values) for values in zip(*columns, strict=True)]
