"""Builds the report of an inspection in its present state."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from app.imports.moved import archive_manifest
from app.inspections.checks import Checks
from app.inspections.corrections import Corrections
from app.inspections.counters import Counters
from app.inspections.observations import Observations, rig_of
from app.inspections.packs import Packs
from app.reports.attached import Attached
from app.reports.bundle.signing import Signer
from app.reports.content.translator import Translator
from app.reports.content.words import Language
from app.reports.report import (
    Entry,
    Extras,
    Kept,
    Measured,
    Report,
    Role,
    Source,
    Taken,
    Units,
    along_the_pipe,
)
from app.reports.template import Section
from app.reports.templates import ReportTemplates, company_of
from app.reports.text.naming import file_stem
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs, StoredBlob
from app.storage.database.tables import IMPORTED, Inspection
from app.storage.folder.signing_key import SigningKey
from app.storage.records.assets import AssetStore
from app.storage.records.assets import asset_of as registered_asset
from app.storage.records.attachments import AttachmentStore
from app.storage.records.findings import FindingStore
from app.storage.records.inspections import InspectionStore
from app.storage.records.labels import LabelStore
from app.storage.records.observations import ObservationStore
from app.storage.records.reviews import ReviewStore
from app.storage.storage import Stored
from app.survey.assets.register import Line, one_line
from app.survey.catalogue.table import CodeTable
from app.survey.distances.interval import half_width_m
from app.survey.distances.track_rows import estimate_at, is_unmeasured
from app.survey.fields.header import asset_of, number_of, project_of
from app.survey.observations.attachments import Attachment
from app.survey.observations.review import ReviewState
from app.survey.places.alignment import Alignment, alignment_of
from app.survey.places.place import ObservationView, WallUnder
from app.survey.places.stretches import role_and_number, stretches
from app.survey.rounding import metres, rounded
from app.tracking.tracks import Tracks
from app.tracking.unrolled import Unrolled
from vo_core import Rig
from vo_core.errors import InvalidRig
from vo_core.mosaic.layout import Layout

NO_EXTRAS = Extras()
_NOT_BY_LINK: tuple[Section, ...] = ("scene", "checks")
"""Sections that a client does not see by a link: what needs scripts, and the history, in which
colleagues talk to each other.
"""
_ROLES: Mapping[str, Role] = {"A": "start", "C": "change", "B": "finish"}
_OF_ROW = (
    "id", "name", "status", "created_at", "finished_at", "revision", "header", "reviewed_by",
    "reviewed_at", "tracked_with", "warning", "error_code",
)  # fmt: skip
"""Fields of a report that are those of the inspection's row."""
_BESIDE_THE_FILM = {
    archive_manifest.COUNTER: keys.counter,
    archive_manifest.READINGS: keys.counter_readings,
    archive_manifest.PARTS: keys.marks,
}
"""What is stored of an inspection beside its film, by its names in an archive file."""


class Measurements:
    """Collects what was measured along a film."""

    def __init__(
        self,
        blobs: Blobs,
        tracks: Tracks,
        corrections: Corrections,
        counters: Counters,
        unrolled: Unrolled,
    ) -> None:
        self._blobs = blobs
        self._tracks = tracks
        self._corrections = corrections
        self._counters = counters
        self._unrolled = unrolled

    def state(self, inspection_id: str) -> Hashable:
        """Return a value that changes with what was read from the film."""
        return self._counters.kept(inspection_id)

    def of(self, row: Inspection) -> Measured:
        """Return what was measured of an inspection."""
        track, raw = self._corrections.track(row.id), self._tracks.get(row.id)
        end_mm, sigma_mm = _last(track.distance_mm), _last(track.sigma_distance_mm)
        if is_unmeasured(raw):
            sigma_mm = None
        return Measured(
            distance_m=_metres(end_mm),
            u95_m=None if sigma_mm is None else half_width_m(sigma_mm),
            raw_distance_m=_metres(_last(raw.distance_mm)),
            corrected=self._corrections.get(row.id),
            track=track,
            raw_track=raw,
            health=self._tracks.health(row.id).columns(),
            sightings=tuple(self._tracks.sightings(row.id)),
            wall={
                tile.index: StoredBlob(self._blobs, keys.tile(row.id, tile.index))
                for tile in self._unrolled.tiles(row.id)
            },
            layout=self._layout(rig_of(row)),
            counter=self._counters.get(row.id),
            initial_pose=self._tracks.initial_pose(row.id),
        )

    def _layout(self, rig: Rig) -> Layout | None:
        try:
            return self._unrolled.layout(rig)
        except InvalidRig:  # a camera that sees no wall
            return None


class ReportBuilder:
    """Builds reports of what is stored."""

    def __init__(
        self,
        stored: Stored,
        measurements: Measurements,
        observations: Observations,
        checks: Checks,
        packs: Packs,
        templates: ReportTemplates,
    ) -> None:
        self._inspections = InspectionStore(stored.database)
        self._attachments = AttachmentStore(stored.database)
        self._labels = LabelStore(stored.database)
        self._reviews = ReviewStore(stored.database)
        self._register = AssetStore(stored.database)
        self._findings = FindingStore(stored.database, ObservationStore(stored.database))
        self._blobs = stored.blobs
        self._scratch = stored.folder.root
        self._measurements = measurements
        self._observations = observations
        self._checks = checks
        self._packs = packs
        self._templates = templates
        self.signer: Signer = SigningKey(stored.folder.root)
        self.draw_scene: Callable[[Report], str] | None = None
        """Draws the 3D view for the page; a room above this one gives it."""

    def state(self, inspection_id: str) -> Hashable:
        """Return a value that changes with the report.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        return (
            self._inspections.state(inspection_id),
            self._attachments.state(inspection_id),
            self._measurements.state(inspection_id),
            self._templates.of_inspection(inspection_id).version,
            self._register.state(),
            self._findings.state(inspection_id),
        )

    def report(
        self,
        inspection_id: str,
        *,
        language: Language = "en",
        units: Units = "m",
        extras: Extras = NO_EXTRAS,
    ) -> Report:
        """Build the report.

        Raises:
            InspectionNotFound: No inspection has this id.
        """
        row = self._inspections.get(inspection_id)
        measured = self._measurements.of(row)
        observations = self._observations.all(inspection_id)
        attachments = self._attachments.listed(inspection_id)
        template = self._templates.of_project(project_of(row.header)).template
        if extras.for_acceptance:
            chosen = [one for one in template.sections if one not in _NOT_BY_LINK]
            template = template.model_copy(update={"sections": chosen})
        line = self._line_of(row.header)
        words = Translator(language, units)
        attached = Attached(
            self._blobs,
            file_stem(str(row.header.get("asset_id") or row.name)),
            attachments,
            words.burnt_in if extras.burnt_in else None,
            partial(_taken, measured),
            words("acceptance.mark") if extras.for_acceptance else None,
        )
        alignment = alignment_of(row.header, line, measured.distance_m)
        table = self._packs.table_of(row.header)
        return Report(
            **{name: getattr(row, name) for name in _OF_ROW},
            **vars(measured),
            error=row.error_detail,
            review=cast("ReviewState", row.review_state),
            made_at=datetime.now(UTC),
            proposals=self._findings.counts(inspection_id),
            labels=self._labels.of([inspection_id]).get(inspection_id, ()),
            pack=table.name,
            ratings=table.ratings,
            rig=rig_of(row),
            source=Source(
                row.source_kind, row.source_filename, row.source_size, row.source_sha256, row.video
            ),
            entries=along_the_pipe(self._entries(row, observations, attached, alignment)),
            issues=tuple(self._checks.run(inspection_id, observations)),
            events=tuple(self._observations.events(inspection_id)),
            company=company_of(template, self._templates.company),
            signer=self.signer,
            film=_film(self._blobs, row),
            scratch=self._scratch,
            template=template,
            line=line,
            draw_scene=self.draw_scene,
            extras=extras,
            kept=self._kept_of(row, attachments),
            language=language,
            units=units,
        )

    def _entries(
        self,
        row: Inspection,
        observations: Sequence[ObservationView],
        attached: Attached,
        alignment: Alignment | None,
    ) -> Sequence[Entry]:
        rig, table = rig_of(row), self._packs.table_of(row.header)
        lengths_m = _stretch_lengths_m(observations)
        entries = [
            attached.added_to(_entry(item, rig, table, row.header, alignment, lengths_m), item.row)
            for item in observations
        ]
        if row.source_kind == IMPORTED:
            return _at_stated_times(entries, has_times=row.video.get("duration_s") is not None)
        return entries

    def _kept_of(self, row: Inspection, attachments: Sequence[Attachment]) -> Kept:
        """Return what the inspection takes along to another server; nothing large is read."""
        files = {
            name: StoredBlob(self._blobs, key_of(row.id))
            for name, key_of in _BESIDE_THE_FILM.items()
        }
        remarks = tuple(self._reviews.remarks(row.id))
        findings = tuple(self._findings.listed(row.id))
        pack_table = self._packs.csv_of(row.header)
        return Kept(tuple(attachments), remarks, files, pack_table, findings)

    def _line_of(self, header: Mapping[str, Any]) -> Line:
        asset_id = asset_of(header)
        row = self._register.find(one_line(asset_id)) if asset_id else None
        return registered_asset(row).line if row else ()


def _taken(measured: Measured, frame: int) -> Taken:
    seen = estimate_at(measured.track, frame)
    if seen is None:
        return Taken(None, None, None)
    has_sigma = not is_unmeasured(measured.raw_track)
    u95_m = half_width_m(seen.sigma_distance_mm) if has_sigma else None
    adjusted = measured.corrected.adjusted
    source = None if adjusted is None else adjusted.source_at(frame)
    return Taken(rounded(seen.time_s, 3), metres(seen.distance_mm), u95_m, source)


def _film(blobs: Blobs, row: Inspection) -> StoredBlob | None:
    """Return the film; while it is recorded it has no checksum, and is elsewhere."""
    if not (row.has_film and row.source_sha256):
        return None
    return StoredBlob(blobs, keys.film(row.id, row.video_file))


def _entry(
    view: ObservationView,
    rig: Rig,
    table: CodeTable,
    header: Mapping[str, Any],
    alignment: Alignment | None,
    lengths_m: Mapping[str, float],
) -> Entry:
    row, place, tag = view.row, view.place, view.row.tag
    role, number = role_and_number(tag.continuous) if tag.continuous else (None, None)
    derived: dict[str, Any] = {}
    if place is not None:
        distance_m = metres(place.distance_mm)
        derived = {
            "time_s": rounded(place.time_s, 3),
            "distance_m": distance_m,
            "u95_m": place.u95_m,
            "raw_m": metres(place.raw_mm),
            "source": place.source,
            "to_go_m": _to_go_m(header, distance_m),
            "joint_no": place.joint_no,
            "at_joint": view.at_joint,
        }
        if alignment is not None:
            derived["lon"], derived["lat"] = alignment.at(distance_m)
        if place.wall is not None:
            derived |= {"clock_h": place.wall.clock_h, **_wall_point_m(place.wall, rig)}
    return Entry(
        id=row.id,
        seq=row.seq,
        tag=tag,
        kind=table.named(tag.code, tag.char1, tag.char2),
        clock_from=view.clock,
        cont_id=number,
        cont_role=_ROLES[role] if role else None,
        cont_length_m=lengths_m.get(row.id),
        figures=view.figures,
        tagged_by=row.created_by,
        tagged_at=row.created_at,
        edited_at=row.edited_at,
        edited_by=row.edited_by,
        **derived,
    )


def _at_stated_times(entries: Sequence[Entry], *, has_times: bool) -> list[Entry]:
    """Return the rows of an import with the times of its file; those of the track only order them.

    Imports of earlier versions have no stated times, but those of the track are close.
    """
    if has_times and all(entry.tag.film_time_s is None for entry in entries):
        return list(entries)
    return [replace(entry, time_s=entry.tag.film_time_s) for entry in entries]


def _stretch_lengths_m(observations: Sequence[ObservationView]) -> dict[str, float]:
    """Return the lengths of finished, tracked stretches by the observation that starts them."""
    place_m = {view.row.id: metres(view.place.distance_mm) for view in observations if view.place}
    tracked = [view.row for view in observations if view.place]
    return {
        start.id: rounded(place_m[stretch.finishes[-1].id] - place_m[start.id], 3)
        for stretch in stretches(tracked)
        if stretch.finishes
        for start in stretch.starts
    }


def _wall_point_m(wall: WallUnder, rig: Rig) -> dict[str, float]:
    """Return X along the axis, Y right, Z down from the axis, or from the floor."""
    z_mm = 0.0
    if wall.clock_h is not None and rig.pipe.radius_mm is not None:
        z_mm = -rig.pipe.radius_mm * math.cos(math.radians(30 * wall.clock_h))
    places = {"x_m": wall.distance_mm, "y_m": wall.lateral_mm, "z_m": z_mm}
    return {name: metres(mm) for name, mm in places.items()}


def _to_go_m(header: Mapping[str, Any], distance_m: float) -> float | None:
    known_m = number_of(header.get("known_length_m"))
    return None if known_m is None else rounded(known_m - distance_m, 3)


def _last(values: NDArray[np.float64]) -> float | None:
    return float(values[-1]) if len(values) else None


def _metres(mm: float | None) -> float | None:
    return None if mm is None else metres(mm)
