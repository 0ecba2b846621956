"""The sample inspection: rendered once by a child process, then imported like an uploaded video."""

from __future__ import annotations

import hashlib
import logging
import shutil
import threading
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from app.errors import InspectionNotFound, SampleBeingMade
from app.inspections.films.films import Films
from app.inspections.inspections import Inspections
from app.inspections.observations import Observations
from app.jobs.messages import Limits, Progress
from app.jobs.process import Child, ask_about_media
from app.jobs.requests.sample import SampleRequest
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.folder.files import DataFolder
from vo_core import Rig
from vo_core.errors import ChainageError

if TYPE_CHECKING:
    from app.lab.simulation.scenario import Scenario

logger = logging.getLogger(__name__)

LENGTH_MM: float | None = None
"""Length of the drive; None for that of the scenario."""
NAME = "Sample culvert"
WHO = "chainage"

_LIMITS = Limits(memory_bytes=1536 * 2**20, cpu_s=600, file_bytes=32 * 2**20)
"""Limits of the child: drawing the wall takes some 400 MiB and 20 s, the video some 8 MiB."""
_ROOM_BYTES = 20 * 2**20
"""Free space for the video and its copy in the inspection."""
_STALL_S = 60.0
"""Time without progress that counts as a stall; drawing the wall before the first frame takes 2 s
on two cores."""
_STOP_S = 10.0


@dataclass(frozen=True)
class SampleState:
    """Progress of the sample."""

    state: Literal["none", "rendering", "ready", "failed"]
    frames_done: int = 0
    frames_total: int | None = None
    """Known from the first frame on."""
    inspection_id: str | None = None
    """Set when the sample is ready."""
    fault: str | None = None
    """A sentence that says why it failed."""

    @property
    def progress(self) -> float:
        """Progress from 0 to 1."""
        if self.state == "ready":
            return 1.0
        return self.frames_done / self.frames_total if self.frames_total else 0.0


class Samples:
    """Makes one sample at a time, in its own thread."""

    def __init__(
        self,
        folder: DataFolder,
        blobs: Blobs,
        inspections: Inspections,
        films: Films,
        observations: Observations,
    ) -> None:
        self._folder = folder
        self._blobs = blobs
        self._inspections = inspections
        self._films = films
        self._observations = observations
        self._changed = threading.Condition()
        """Guards the next fields; notified at each step."""
        self._making: SampleState | None = None
        """State during rendering, and after a failure."""
        self._child: Child | None = None
        self._thread: threading.Thread | None = None
        self._stopping = False

    def state(self) -> SampleState:
        """Return the current state."""
        with self._changed:
            if self._making is not None:
                return self._making
        inspection_id = self._existing()
        if inspection_id is None:
            return SampleState("none")
        return SampleState("ready", inspection_id=inspection_id)

    def start(self) -> SampleState:
        """Start rendering, unless the sample inspection exists.

        Raises:
            SampleBeingMade: The sample is not ready yet.
        """
        before = self.state()
        with self._changed:
            if self._making is not None and self._making.state == "rendering":
                raise SampleBeingMade("The sample inspection is being made; it is ready soon.")
            if before.state == "ready":
                return before
            self._making = SampleState("rendering")
            self._thread = threading.Thread(target=self._make, name="sample", daemon=True)
            self._thread.start()
            return self._making

    def wait(self, on_progress: Callable[[int, int], None]) -> SampleState:
        """Wait until the sample is ready, has failed or was stopped; the limits of the child bound
        this.

        Args:
            on_progress: Called with frames done and the total.
        """
        while (state := self.state()).state == "rendering":
            if state.frames_total is not None:
                on_progress(state.frames_done, state.frames_total)
            with self._changed:
                if self._making is state:
                    self._changed.wait(_STALL_S)
        return state

    def stop(self) -> None:
        """End the child and the thread."""
        with self._changed:
            self._stopping = True
            thread = self._thread
            if self._child is not None:
                self._child.terminate()
        if thread is not None:
            thread.join(_STOP_S)

    def _make(self) -> None:
        try:
            self._add(self._rendered())
        except ChainageError as error:
            # When the server stops, the end of the child is no failure.
            self._set_state(None if self._stopping else SampleState("failed", fault=str(error)))
        except Exception:
            logger.exception("The sample inspection could not be made.")
            fault = "The sample failed because of a fault in the program; it is in the log."
            self._set_state(SampleState("failed", fault=fault))
        else:
            self._set_state(None)

    def _set_state(self, state: SampleState | None) -> None:
        with self._changed:
            self._making = state
            self._changed.notify_all()

    def _existing(self) -> str | None:
        """Return the id of the sample inspection, unless it was deleted."""
        try:
            inspection_id = self._blobs.get(keys.SAMPLE).decode("ascii")
            self._inspections.row(inspection_id)
        except (FileNotFoundError, InspectionNotFound):
            return None
        return inspection_id

    def _add(self, files: Path) -> None:
        """Import the video and add three tags."""
        rig = Rig.load(files / "rig.json")
        inspection_id = self._films.import_video(
            files / "video.mp4", rig, NAME, header(rig, datetime.now().astimezone())
        )
        from app.lab.simulation.sample import tags

        for tag in tags(_scenario()):
            self._observations.put(inspection_id, str(uuid.uuid4()), tag, WHO)
        self._blobs.put(keys.SAMPLE, inspection_id.encode())

    def _rendered(self) -> Path:
        """Return the folder of the rendered sample; remove that of an earlier version."""
        target = self._folder.sample / _version()
        if target.is_dir():
            return target
        shutil.rmtree(self._folder.sample, ignore_errors=True)
        self._folder.require_room(_ROOM_BYTES)
        part = target.with_suffix(".part")
        part.mkdir(parents=True)
        self._render(part)
        part.rename(target)
        return target

    def _render(self, folder: Path) -> None:
        def report(progress: Progress) -> None:
            self._set_state(SampleState("rendering", progress.done, progress.total))

        with Child("app.jobs.requests.sample") as child:
            with self._changed:
                self._child = child
                if self._stopping:
                    child.terminate()
            try:
                ask_about_media(
                    child,
                    SampleRequest(str(folder), _scenario().length_mm, _LIMITS),
                    type(None),
                    work="Rendering the sample",
                    stall_s=_STALL_S,
                    part=Progress,
                    on_part=report,
                )
            finally:
                with self._changed:
                    self._child = None


def _scenario() -> Scenario:
    from app.lab.simulation.sample import SAMPLE  # loads the renderer

    return SAMPLE if LENGTH_MM is None else SAMPLE.shortened(LENGTH_MM)


def header(rig: Rig, now: datetime) -> dict[str, Any]:
    """Return the known header fields of the sample; the user states how the drive ended."""
    segment_mm = rig.pipe.segment_length_mm
    return {
        "asset_id": "CUL-0001",
        "start_node": "Inlet headwall",
        "end_node": "Outlet headwall",
        "direction": "with_flow",
        "date": now.date().isoformat(),
        "time": now.strftime("%H:%M"),
        "operator": "Chainage",
        "client": "Sample",
        "asset_type": "culvert",
        "shape": "circular",
        "height_mm": rig.pipe.diameter_mm,
        "material": "Concrete",
        "unit_length_m": None if segment_mm is None else segment_mm / 1000,
        "reference_point": "Inner face of the headwall at the start",
        "standard": "EN 13508-2",
        "edition": "2003+A1:2011",
        "method": "camera",
        "remarks": "A rendered culvert, to try Chainage with.",
    }


def _version() -> str:
    """Return the version of the rendering; another version is rendered anew."""
    described = f"{version('chainage')} {_scenario()!r}"
    return hashlib.sha256(described.encode()).hexdigest()[:16]
