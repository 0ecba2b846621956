"""Keeps one 3D scene up to date: track, wall, joints and tags, as a page sees them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Literal

from app.back_off import BackOff
from app.errors import InspectionNotFound, StoreUnavailable, TileNotFound
from app.inspections.corrections import Corrections
from app.inspections.inspections import Inspections
from app.inspections.observations import Observations, rig_of
from app.inspections.packs import Packs
from app.reports.content.words import Language
from app.survey.adjustment.adjusted_track import Adjusted, Source
from app.survey.catalogue.table import Code, CodeTable
from app.survey.observations.tag import StatedTag
from app.survey.places.measure import Figure
from app.survey.places.place import ObservationView
from app.survey.places.stretches import stretches
from app.survey.rounding import metres
from app.tracking.live import (
    DistancesCorrected,
    Event,
    Live,
    ObservationsChanged,
    Update,
    WallChanged,
)
from app.tracking.unrolled import Unrolled
from app.tracking.worker import Worker
from app.viewer.culvert import JointMark
from app.viewer.look import ALL, Look
from app.viewer.pin import Pin
from app.viewer.scene import CulvertScene
from app.viewer.wall import WallPictures
from vo_core import Track

logger = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 10.0
_PINS_PAUSE_S = 0.3
_AGAIN = BackOff(first_s=0.5, longest_s=30.0)
"""Pauses after drawings that failed, such as while the database is busy."""


_OF_SCENE = frozenset(("mode", "cut", "selected"))


_Part = Literal["reset", "track", "frames", "robot", "wall", "wording", "pins"]
"""What may be due: the path from its start, the corrected track, the newest frames ..."""


class SceneFeed(Worker):
    """One scene with the thread that updates it.

    Events and requests only mark what is due; a separate thread reads and draws it. So tagging and
    tracking never wait for drawing, and since only one thread draws, the state it read last is
    shown.
    """

    def __init__(
        self,
        inspection_id: str,
        socket_path: Path,
        inspections: Inspections,
        corrections: Corrections,
        observations: Observations,
        unrolled: Unrolled,
        live: Live,
        packs: Packs,
        look: Callable[[], Look],
    ) -> None:
        """Block for some milliseconds; call it in a worker thread.

        `look` is called at each drawing, so that the newest look applies.
        """
        super().__init__("scene-feed", stop_timeout_s=_STOP_TIMEOUT_S)
        self._inspection_id = inspection_id
        self._look = look
        self._unrolled = unrolled
        self._inspections = inspections
        self._corrections = corrections
        self._observations = observations
        self._packs = packs
        inspection = inspections.row(inspection_id)
        rig = rig_of(inspection)
        self._wall_layout = unrolled.layout(rig)
        self.scene = CulvertScene(rig, socket_path)
        self._due: set[_Part] = set()
        self._newest: Update | None = None
        """Of the tracking."""
        self._drawn = 0
        """Number of frames whose path is drawn."""
        self._failures = 0
        """Drawings in a row that failed."""
        self._joints_of: Adjusted | None = None
        """The correction whose joints are drawn."""
        self._subscription = ExitStack()
        self._subscription.enter_context(live.listening(inspection_id, self._on_event))
        try:
            self.show_look(ALL)
            self._draw({"track", "wall", "wording"}, None)
        except BaseException:
            self._subscription.close()
            self.scene.close()
            raise
        self.start()

    def close(self) -> None:
        """Stop updating and disconnect every browser; blocks until the current drawing is done."""
        self._subscription.close()
        self.stop()
        self.scene.close()

    def show_look(self, changed: Collection[str]) -> None:
        """Schedule drawing of what depends on these fields of the look."""
        look = self._look()
        self.scene.show(**{name: getattr(look, name) for name in _OF_SCENE.intersection(changed)})
        if "is_measuring" in changed:
            self.scene.set_measuring(look.is_measuring)
        if "frame" in changed:
            self._note("robot")
        if "wording" in changed:
            self._note("wording")

    def _note(self, *due: _Part) -> None:
        with self._changed:
            self._due.update(due)
        self.wake()

    def _step(self) -> float | None:
        with self._changed:
            # The tag is answered first: drawing 2000 pins takes as long as storing one.
            self._changed.wait_for(lambda: self._due != {"pins"} or self._stopping, _PINS_PAUSE_S)
            due, self._due = self._due, set()
            newest = self._newest
        if not due or self._stopping:
            return None
        try:
            self._draw(due, newest)
        except InspectionNotFound:  # deleted while somebody looked at it
            logger.debug("Inspection %s has been deleted.", self._inspection_id)
        except Exception:
            logger.exception(
                "Inspection %s could not be drawn and is drawn again.", self._inspection_id
            )
            self._pause(_AGAIN.pause_s(self._failures))
            self._note("reset", "track", "robot", "wall", "wording")
            self._failures += 1
        else:
            self._failures = 0
        return None

    def _draw(self, due: set[_Part], newest: Update | None) -> None:
        if "reset" in due:
            self._drawn = 0
            self.scene.reset_path()
        if "track" in due:
            self._draw_track()
        elif "frames" in due and newest is not None:
            self._draw_frames(newest)
        if due & {"robot", "track"}:
            self._draw_robot()
        if "wall" in due:
            self._draw_wall()
        if "wording" in due:
            self.scene.show(wording=self._look().wording)
        if due & {"wording", "pins"}:
            self._draw_pins()

    def _draw_track(self) -> None:
        self._extend_path(self._corrections.track(self._inspection_id))
        self._draw_joints(self._corrections.adjusted(self._inspection_id))

    def _draw_joints(self, adjusted: Adjusted) -> None:
        if adjusted is not self._joints_of:
            self._joints_of = adjusted
            self.scene.show(joints=joint_marks(adjusted))

    def _draw_robot(self) -> None:
        estimate = self._corrections.at(self._inspection_id, self._look().frame)
        if estimate is not None:
            initial_pose = self._corrections.initial_pose(self._inspection_id)
            self.scene.show(pose=initial_pose.added_to(estimate))

    def _extend_path(self, track: Track) -> None:
        new = slice(self._drawn, None)
        if len(track) > self._drawn:
            y_mm = track.y_mm[new] + self._corrections.initial_pose(self._inspection_id).y_mm
            self.scene.extend_path(
                track.distance_mm[new].tolist(),
                y_mm.tolist(),
                track.sigma_distance_mm[new].tolist(),
            )
            self.scene.show(length_m=float(track.distance_mm.max()) / 1000)
            self._drawn = len(track)

    def _draw_wall(self) -> None:
        pictures = WallPictures.placed(
            {tile.index: tile.revision for tile in self._unrolled.tiles(self._inspection_id)},
            self._wall_layout,
            partial(self._corrections.chainage_mm, self._inspection_id),
            self._wall_picture,
        )
        self.scene.show(wall=pictures)

    def _wall_picture(self, index: int) -> bytes | None:
        try:
            return self._unrolled.picture(self._inspection_id, index)
        except (TileNotFound, StoreUnavailable):
            return None  # tracking has started again, or the tile can be read later

    def _draw_pins(self) -> None:
        views = self._observations.all(self._inspection_id)
        table = self._packs.table_of(self._inspections.row(self._inspection_id).header)
        self.scene.show(pins=_pins(views, table, self._look().wording.language))

    def _on_event(self, event: Event) -> None:
        """Mark what is due; called in the publisher's thread."""
        match event:
            case Update(estimates=(), state="running"):
                self._newest = None
                self._note("reset", "wall", "pins")
            case Update(estimates=()):
                self._note("pins")  # distances appear or vanish with the track
            case Update():
                self._newest = event
                self._note("frames")
            case DistancesCorrected():
                self._note("reset", "track", "wall", "pins")
            case WallChanged():
                self._note("wall")
            case ObservationsChanged():
                self._note("pins")

    def _draw_frames(self, update: Update) -> None:
        initial_pose = self._corrections.initial_pose(self._inspection_id)
        new = [
            initial_pose.added_to(self._corrections.estimate(self._inspection_id, raw))
            for raw in update.estimates
        ]
        if new[0].frame == self._drawn:
            self.scene.extend_path(
                [e.distance_mm for e in new],
                [e.y_mm for e in new],
                [e.sigma_distance_mm for e in new],
            )
            self._drawn += len(new)
        else:  # more batches came since the last drawing
            self._extend_path(self._corrections.track(self._inspection_id))
        self._draw_joints(self._corrections.newest(self._inspection_id))
        if self._look().frame is None:
            self.scene.show(pose=new[-1])
            if update.jpeg:
                self.scene.show(preview=update.jpeg)


def joint_marks(adjusted: Adjusted) -> list[JointMark]:
    """Return the joints that were seen, and the places where others are expected."""
    return [
        JointMark(joint.number, metres(joint.distance_mm), is_seen=is_seen)
        for joints, is_seen in ((adjusted.joints, True), (adjusted.expected_joints, False))
        for joint in joints
    ]


def _pins(views: Sequence[ObservationView], table: CodeTable, language: Language) -> list[Pin]:
    """Make the pins; only the start of a stretch has a band, its other observations are plain
    pins.
    """
    placed = {view.row.id: view for view in views if view.place is not None}
    finishes = {
        start.id: finish.id
        for stretch in stretches(view.row for view in placed.values())
        for start, finish in zip(stretch.starts, stretch.finishes, strict=False)
    }
    pins: list[Pin] = []
    for id_, view in placed.items():
        tag, place = view.row.tag, view.place
        assert place is not None  # noqa: S101  (they are chosen so)
        finish = placed.get(finishes.get(id_, ""))
        pins.append(
            defect_pin(
                id_,
                tag,
                table.named(tag.code, tag.char1, tag.char2),
                language,
                distance_m=metres(place.distance_mm),
                finish_m=metres(finish.place.distance_mm) if finish and finish.place else None,
                u95_m=place.u95_m,
                source=place.source,
                clock_h=place.wall.clock_h if place.wall else None,
                lateral_m=place.wall.lateral_mm / 1000 if place.wall else 0.0,
                figures=view.figures,
            )
        )
    return pins


def defect_pin(
    observation_id: str,
    tag: StatedTag,
    kind: Code | None,
    language: Language,
    *,
    distance_m: float,
    finish_m: float | None,
    u95_m: float | None,
    source: Source | None,
    clock_h: float | None,
    lateral_m: float,
    figures: Sequence[Figure | None],
) -> Pin:
    """Return the pin of an observation: its tag, its row in the code pack if that has one, and the
    corrected places.

    `finish_m` is that of a stretch which begins here; `clock_h`, the exact position by the pixel,
    counts where none was stated.
    """
    code = " ".join(filter(None, (tag.code, tag.char1, tag.char2)))
    label = None if kind is None else kind.label_in(language)
    return Pin(
        id=observation_id,
        distance_m=distance_m,
        clock=tag.clock_from or clock_h,
        u95_m=u95_m,
        source=source,
        severity=tag.severity,
        label=f"{code} {label.partition(':')[0]}" if label else code or "?",
        lateral_m=lateral_m,
        clock_to=tag.clock_to if tag.clock_from else None,
        finish_m=finish_m,
        measured_m=tuple(_line_m(figure) for figure in figures if figure),
    )


def _line_m(figure: Figure) -> tuple[tuple[float, float, float], ...]:
    points = tuple((x / 1000, y / 1000, z / 1000) for x, y, z in figure.points_mm)
    return (*points, points[0]) if figure.kind == "area" else points
