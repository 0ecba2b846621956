"""Has one wall searched by a detector, in a child process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass

from app.errors import BlobNotFound
from app.inspections.findings.detectors import FINDER, Detectors
from app.jobs.messages import Limits
from app.jobs.process import Child, ask_about_media
from app.jobs.requests.finder import FinderRequest, FoundSize, Searched
from app.jobs.requests.finder import Found as Told
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.database.tables import Inspection
from app.survey.findings.declaration import DetectedClass
from app.survey.findings.records import CLASSICAL, Proposal, Size
from app.tracking.films.work import polling
from app.tracking.unrolled import Unrolled

BLOCK_TILES = 2
"""As in `vo_core.findings.patches`, which loads OpenCV."""
_STALL_S = 120.0
"""Processor time without a block that counts as a stall."""


@dataclass(frozen=True)
class Found:
    """What a child has found."""

    proposals: list[Proposal]
    detector: tuple[str, str]
    """Name and version."""
    to_mm: float
    """Raw axial coordinate up to which it has searched."""


@dataclass(frozen=True)
class Finder:
    """Searches walls, one at a time."""

    unrolled: Unrolled
    blobs: Blobs
    detectors: Detectors
    limits: Limits
    """Of each child."""

    def require(self, detector: str) -> None:
        """Raise DetectorNotFound unless there is such a detector."""
        if detector != CLASSICAL:
            self.detectors.get(detector)

    def search(
        self,
        row: Inspection,
        detector: str,
        blocks: list[int] | None,
        is_stopped: Callable[[], bool],
        note: Callable[[float], None],
    ) -> Found:
        """Have a child search, and return what it has found.

        Args:
            row: The inspection.
            detector: `CLASSICAL`, or the id of a model.
            blocks: Blocks of tiles to search; None for all.
            is_stopped: Once it is true, the search fails.
            note: Told how far it is.
        Raises:
            MediaFailed, MediaTimeout: It died, failed, was stopped, or took too long.
            DetectorNotFound, BlobNotFound: The model was deleted.
        """
        told: list[Told] = []
        to_mm = 0.0

        def take(part: Searched) -> None:
            nonlocal to_mm
            told.extend(part.found)
            to_mm = part.to_mm
            note(to_mm)

        with ExitStack() as stack:
            tiles: dict[int, str] = {}
            for tile in self.unrolled.tiles(row.id):
                with suppress(BlobNotFound):  # it is deleted, or tracked again
                    key = keys.tile(row.id, tile.index)
                    tiles[tile.index] = str(stack.enter_context(self.blobs.local(key)))
            model = None
            name, codes = CLASSICAL, {}
            if detector != CLASSICAL:
                view, model = stack.enter_context(self.detectors.opened(detector))
                name = view.row.name
                codes = {each.kind: _code_of(each) for each in view.declared.classes}
            wanted = sorted({tile // BLOCK_TILES for tile in tiles}) if blocks is None else blocks
            if not wanted:  # nothing was painted
                return Found([], (name, ""), to_mm)
            request = FinderRequest(self.limits, row.rig, tiles, wanted, model)
            child = stack.enter_context(Child(FINDER))
            stack.enter_context(polling(is_stopped, child.terminate))
            version = ask_about_media(
                child, request, str, work="Searching the wall", stall_s=_STALL_S,
                part=Searched, on_part=take,
            )  # fmt: skip
        return Found([_proposal(each, codes) for each in told], (name, version), to_mm)


def _proposal(found: Told, codes: Mapping[str | None, Mapping[str, str] | None]) -> Proposal:
    return Proposal(
        kind=found.kind,
        outline_mm=tuple(found.outline_mm),
        length=_size(found.length),
        width=_size(found.width),
        direction=found.direction,
        score=found.score,
        code=codes.get(found.kind),
    )


def _size(size: FoundSize | None) -> Size | None:
    return None if size is None else Size(size.mm, size.sigma_mm)


def _code_of(declared: DetectedClass) -> Mapping[str, str] | None:
    """Return the code that a model's class names; None if that of its kind is suggested."""
    return declared.model_dump(exclude={"kind"}, exclude_none=True) or None
