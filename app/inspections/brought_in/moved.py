"""Makes an inspection again that was exported whole: as a report in JSON, or as an archive file."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

import msgspec

from app.access.access import Principal
from app.errors import InvalidImport, PackNotFound
from app.imports.moved.archive_manifest import (
    COUNTER,
    FILM,
    PACK,
    PARTS,
    PHOTOS,
    READINGS,
    VOICE,
    WALL,
    not_as_listed,
)
from app.imports.moved.whole_inspection import (
    MovedAttachment,
    MovedEvent,
    MovedFile,
    MovedRemark,
    MovedTag,
    WholeInspection,
)
from app.imports.surveys.survey import Caveat
from app.inspections.brought_in.keeping import Imported, Keeper, Run
from app.inspections.packs import Packs
from app.storage.blobs import keys
from app.storage.database.tables import ENDED, Base, CodePack, Inspection, RemarkRow
from app.storage.folder.files import full_disk_reported
from app.storage.folder.tokens import Role
from app.storage.records.attachments import AttachmentRow
from app.storage.records.findings import FindingRow
from app.storage.records.imports import Rows
from app.storage.storage import Storage
from app.survey.distances.stated import Stated
from app.survey.distances.track_rows import is_unmeasured
from app.survey.fields.header import project_of
from app.survey.labels import distinct
from app.survey.observations.attachments import VOICE_SUFFIXES, Attachment
from app.survey.observations.records import BROUGHT_IN, Event, Observation
from app.survey.observations.review import APPROVED, DRAFT, ReviewState
from app.tracking.live import Live
from app.tracking.pictures.counter_files import KeptCounter
from app.tracking.pictures.media import Media
from app.tracking.pictures.videos import NO_FILM, file_name, video_columns

_BLOCK = 4 * 2**20
_NOT_IN_THE_FILE = "This photo was not in the file that was imported."


class Templates(Protocol):
    """The report templates of this server."""

    def differing(self, project: str | None, other: Mapping[str, Any]) -> tuple[str, ...]:
        """Return what another server's template says otherwise than that of a project here, by the
        names of `brought` in the words of reports; raise InvalidImport if it is no template.
        """

    def take(self, project: str | None, other: Mapping[str, Any], who: str) -> bool:
        """Give it to a project of which nothing is here yet; return whether that is so."""


class MovedInspections:
    """Stores inspections of other servers, with the files that came along."""

    def __init__(
        self,
        storage: Storage,
        keeper: Keeper,
        media: Media,
        packs: Packs,
        templates: Templates,
        live: Live,
    ) -> None:
        self._keeper = keeper
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._media = media
        self._packs = packs
        self._templates = templates
        self._live = live

    def add(
        self, whole: WholeInspection, filename: str, who: Principal, archive: Path | None = None
    ) -> Imported:
        """Store an inspection, with its id if this server never had it.

        Args:
            whole: The checked inspection.
            filename: Name of its file, for the history.
            who: Who imports it. Only an admin's import keeps an approval: it locks the inspection,
                and the file alone does not prove it.
            archive: The archive file in which `whole.files` lie; None if they are in the memory.
        Raises:
            InvalidImport: The files do not fit the inspection.
            UnreadableVideo, RigVideoMismatch: The film cannot be used.
            DiskFull: There is no room for it.
        """
        self._folder.require_room(sum(file.size for file in whole.files.values()))
        with self._keeper.place(whole.about.id) as inspection_id:
            moved = _Moved(whole, inspection_id, filename, who)
            files = _Files(archive)
            film = self._put_film(moved, files)
            self._put_files(moved, files)
            more: list[Base] = [*moved.attachments(), *moved.remarks(), *moved.findings()]
            header, pack = self._header(moved)
            if pack is not None:
                more.append(pack)
            inspection = moved.inspection(header, film)
            labels = distinct(whole.about.labels)
            rows = Rows(inspection, moved.observations(), moved.events(), labels, more)
            self._bring_template(moved)
            run = Run(whole.track, whole.health, whole.sightings, whole.tilt, whole.initial_pose)
            self._keeper.keep([(rows, run)])
        self._live.observations_changed(inspection_id)
        return Imported((inspection_id,), tuple(moved.warnings))

    def _header(self, moved: _Moved) -> tuple[dict[str, Any], CodePack | None]:
        """Return the header and the code pack to add, if this server lacks that of the header."""
        header = dict(moved.whole.about.header)
        try:
            if pack_id := str(header.get("code_pack") or ""):
                self._packs.table(pack_id)
        except PackNotFound:
            table = moved.whole.files.get(PACK)
            if table is not None and table.content is not None and moved.who.role.may(Role.ADMIN):
                place = self._packs.brought(moved.whole.code_pack or pack_id, project_of(header))
                moved.warn("pack_added", name=place["name"])
                return header, CodePack(
                    id=pack_id,
                    **place,
                    table=table.content.decode(),
                    created_at=datetime.now(UTC),
                    created_by=moved.who.name,
                )
            del header["code_pack"]
            moved.warn("no_pack", name=moved.whole.code_pack or pack_id)
        return header, None

    def _bring_template(self, moved: _Moved) -> None:
        """Take the report template along, or name what differs: grade and costs depend on it."""
        theirs, project = moved.whole.report_template, project_of(moved.whole.about.header)
        if theirs is None or not (differing := self._templates.differing(project, theirs)):
            return
        if self._templates.take(project, theirs, moved.who.name):
            moved.warn("template_added", project=project or "")
        else:
            moved.warn("template_differs", named=differing)

    def _put_film(self, moved: _Moved, files: _Files) -> tuple[str, dict[str, Any]] | None:
        """Store the film; return its name and what is stored of it, None without one."""
        whole = moved.whole
        path = next((path for path in whole.files if path.startswith(FILM)), None)
        if path is None:
            return None
        copy = self._folder.inspections / f"{moved.id}.import"
        try:
            files.copy(path, whole.files[path], copy)
            probed = self._media.probe(copy, whole.about.source.filename)
            whole.rig.require_picture_size(probed.width, probed.height)
            name = file_name(probed)
            self._blobs.adopt(keys.film(moved.id, name), copy)
        finally:
            copy.unlink(missing_ok=True)
        # What a browser is given comes from the film, not from the file's word.
        shown = video_columns(probed)
        return name, whole.about.video.model_dump() | {
            column: shown[column] for column in ("media_type", "playable", "container", "codec")
        }

    def _put_files(self, moved: _Moved, files: _Files) -> None:
        whole = moved.whole
        for key, path in moved.media_keys():
            self._blobs.put_again(key, files.read(path, whole.files[path]))
        written = [key for key, _ in moved.media_keys()]
        for path, file in whole.files.items():
            if path.startswith(WALL):
                index = int(path.removeprefix(WALL).removesuffix(".jpg"))
                written.append(keys.tile(moved.id, index))
                self._blobs.put_again(written[-1], files.read(path, file))
        self._blobs.sync(written)
        for path, key_of, check in (
            (READINGS, keys.counter_readings, None),
            (COUNTER, keys.counter, _require_counter),
            (PARTS, keys.marks, None),
        ):
            if path in whole.files:
                content = files.read(path, whole.files[path])
                if check is not None:
                    check(content)
                self._blobs.put(key_of(moved.id), content)


class _Files:
    """Reads the files that came along, in blocks, from the one archive file."""

    def __init__(self, archive: Path | None) -> None:
        self._archive = archive

    def blocks(self, path: str, file: MovedFile) -> Iterator[bytes]:
        """Yield a file; at its end raise InvalidImport if it is not what the manifest lists."""
        if file.content is not None:
            yield file.content
            return
        assert self._archive is not None and file.at is not None  # noqa: S101, PT018  (by its reader)
        digest, left = hashlib.sha256(), file.size
        with self._archive.open("rb") as archive:
            archive.seek(file.at)
            while left and (block := archive.read(min(_BLOCK, left))):
                digest.update(block)
                left -= len(block)
                yield block
        if left or digest.hexdigest() != file.sha256:
            raise InvalidImport(not_as_listed(path))

    def read(self, path: str, file: MovedFile) -> bytes:
        """Return a small file."""
        return b"".join(self.blocks(path, file))

    def copy(self, path: str, file: MovedFile, target: Path) -> None:
        """Copy a large file into the data folder; it is synced on return."""
        with full_disk_reported(), target.open("wb") as copy:
            for block in self.blocks(path, file):
                copy.write(block)
            copy.flush()
            os.fsync(copy.fileno())


class _Moved:
    """The rows of one inspection under its id here; `warnings` grows while they are made."""

    def __init__(
        self, whole: WholeInspection, inspection_id: str, filename: str, who: Principal
    ) -> None:
        self.whole = whole
        self.id = inspection_id
        self.who = who
        self._filename = filename
        self._now = datetime.now(UTC)
        self._has_film = any(path.startswith(FILM) for path in whole.files)
        self.warnings: list[Caveat] = []
        self._review = self._review_state()
        self._name_what_is_missing()

    def warn(self, key: str, **values: str | tuple[str, ...]) -> None:
        """Add a warning, as in `Caveat`."""
        self.warnings.append(Caveat(key, values=values))

    def _name_what_is_missing(self) -> None:
        whole = self.whole
        there = {path.partition("/")[0] + "/" for path in whole.files}
        missing = tuple(
            name
            for folder, name, is_wanted in (
                (FILM, "film", True),
                (PHOTOS, "photos", any(tag.photo_sha256 for tag in whole.tags)),
                (VOICE, "voice_notes", any(a.kind == "voice" for a in whole.attachments)),
                (WALL, "wall", len(whole.track) > 0),
            )
            if is_wanted and folder not in there
        )
        if missing:
            self.warn("not_brought", named=missing)
        if whole.about.status not in ENDED:
            self.warn("exported_early")

    def _review_state(self) -> ReviewState:
        review = self.whole.review
        if review.state != APPROVED or self.who.role.may(Role.ADMIN):
            return review.state
        self.warn("approved_elsewhere", who=review.by or ("somebody",))
        return "submitted"

    def inspection(
        self, header: dict[str, Any], film: tuple[str, dict[str, Any]] | None
    ) -> Inspection:
        """Return the row."""
        whole = self.whole
        has_ended = whole.about.status in ENDED
        is_kept = self._review == whole.review.state
        video_file, video = film or ("", whole.about.video.model_dump())
        track = whole.track
        return Inspection(
            id=self.id,
            name=whole.about.name,
            status=whole.about.status if has_ended else "cancelled",
            rig=whole.rig.model_dump(mode="json"),
            header=header,
            # The film that the distances are based on, though it may not be here.
            source_kind=whole.about.source.kind,
            source_filename=whole.about.source.filename,
            source_size=whole.about.source.size,
            source_sha256=whole.about.source.sha256,
            video_file=video_file,
            video=video,
            distance_mm=float(track.distance_mm[-1]) if len(track) else None,
            sigma_distance_mm=(
                float(track.sigma_distance_mm[-1])
                if len(track) and not is_unmeasured(track)
                else None
            ),
            tracked_with=whole.about.tracked_with,
            warning=whole.about.warning,
            error_code=whole.about.error_code,
            error_detail=whole.about.error,
            corrections=whole.stated.to_json() if whole.stated != Stated() else {},
            revision=whole.about.revision,
            created_at=whole.about.created_at,
            queued_at=self._now,
            finished_at=whole.about.finished_at if has_ended else self._now,
            review_state=self._review,
            reviewed_by=whole.review.by if is_kept else self.who.name,
            reviewed_at=whole.review.at if is_kept else self._now,
        )

    def observations(self) -> list[Observation]:
        """Return the observations."""
        return [self._observation(tag) for tag in self.whole.tags]

    def _observation(self, tag: MovedTag) -> Observation:
        is_there = tag.photo in self.whole.files
        # With the film a photo that is not in the file is made again.
        is_made = tag.photo_sha256 is not None and (is_there or not self._has_film)
        return Observation(
            inspection_id=self.id,
            id=tag.id,
            seq=tag.seq,
            tag=tag.stated,
            photo_frame=tag.stated.frame if is_made else None,
            photo_sha256=tag.photo_sha256 if is_made else None,
            photo_error=None if is_there or self._has_film else self._why_no_photo(),
            created_at=tag.created_at,
            created_by=tag.created_by,
            edited_at=tag.edited_at,
            edited_by=tag.edited_by,
        )

    def _why_no_photo(self) -> str:
        has_photos = any(path.startswith(PHOTOS) for path in self.whole.files)
        return _NOT_IN_THE_FILE if has_photos else NO_FILM

    def attachments(self) -> list[AttachmentRow]:
        """Return the rows of the attachments."""
        return [AttachmentRow.of(self._attachment(one)) for one in self.whole.attachments]

    def _attachment(self, one: MovedAttachment) -> Attachment:
        is_there = one.file in self.whole.files
        can_be_made = self._has_film and one.kind != "voice"
        return Attachment(
            inspection_id=self.id,
            id=one.id,
            observation_id=one.observation_id,
            kind=one.kind,
            rank=one.rank,
            frame=one.frame,
            strokes=tuple(one.strokes),
            media_type=one.media_type,
            duration_s=one.duration_s,
            size=one.size,
            sha256=one.sha256 if is_there or not can_be_made else None,
            photo_error=None if is_there or can_be_made else self._why_no_photo(),
            created_at=one.created_at,
            created_by=one.created_by,
        )

    def remarks(self) -> list[RemarkRow]:
        """Return the rows of the reviewers' remarks."""
        return [self._remark(remark) for remark in self.whole.remarks]

    def _remark(self, remark: MovedRemark) -> RemarkRow:
        return RemarkRow(inspection_id=self.id, **remark.model_dump())

    def findings(self) -> list[FindingRow]:
        """Return the rows of what detectors proposed."""
        return [FindingRow.of(each.finding(self.id)) for each in self.whole.findings]

    def media_keys(self) -> Iterator[tuple[str, str]]:
        """Yield the key of each photo and voice note that came along, and its path in the file."""
        for tag in self.whole.tags:
            if tag.photo is not None and tag.photo in self.whole.files:
                yield keys.photo(self.id, tag.id, tag.stated.frame), tag.photo
        for one in self.whole.attachments:
            if one.file is not None and one.file in self.whole.files:
                if one.kind == "voice":
                    suffix = VOICE_SUFFIXES[one.media_type or ""]
                    yield keys.voice(self.id, one.id, suffix), one.file
                else:
                    yield keys.photo(self.id, one.id, one.frame), one.file

    def events(self) -> Sequence[Event]:
        """Return its history, which the import ends."""
        is_kept = self._review == self.whole.review.state != DRAFT
        brought_in = Event(
            inspection_id=self.id,
            action=BROUGHT_IN,
            who=self.who.name,
            at=self._now,
            before=None,
            after={"review": self._review} if is_kept else None,
            remark=f"Imported from {self._filename}.",
        )
        return [*(self._happened(event) for event in self.whole.events), brought_in]

    def _happened(self, event: MovedEvent) -> Event:
        return Event(inspection_id=self.id, **event.model_dump())


def _require_counter(content: bytes) -> None:
    try:
        msgspec.json.decode(content, type=KeptCounter)
    except msgspec.MsgspecError as error:
        raise InvalidImport(f"{COUNTER} is not what Chainage writes: {error}") from error
