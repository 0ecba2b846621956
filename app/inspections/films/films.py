"""The films of inspections that are files: uploaded, of this machine, or of the archive."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from app.inspections.films.making import NewInspections, checked_rig, keep_rig
from app.inspections.films.uploads import Uploads
from app.inspections.register import Register
from app.storage.blobs import keys
from app.storage.database.tables import Inspection
from app.storage.folder.files import copy_durably, sha256_of
from app.storage.records.inspections import InspectionStore
from app.storage.storage import Storage
from app.tracking.films.queue import Tracking
from app.tracking.pictures.counter_files import SEARCHED, CounterFiles, KeptCounter
from app.tracking.pictures.media import Media
from app.tracking.pictures.videos import file_name, video_columns
from vo_core import Rig

logger = logging.getLogger(__name__)

DESK_PRIORITY = 10
"""Priority of what people at the desk wait for; that of films of the archive is lower."""
Add = Callable[[Inspection, str], None]
"""Adds a new inspection to the database, for a person named by the second argument."""


class Films:
    """Makes an inspection of each new film."""

    def __init__(
        self,
        storage: Storage,
        media: Media,
        uploads: Uploads,
        counters: CounterFiles,
        register: Register,
        tracking: Tracking,
    ) -> None:
        self._store = InspectionStore(storage.database)
        self._folder = storage.folder
        self._blobs = storage.blobs
        self._media = media
        self._uploads = uploads
        self._counters = counters
        self._new = NewInspections(storage.blobs, register)
        self._tracking = tracking

    def create_from_upload(
        self,
        name: str,
        upload_id: str,
        rig: Mapping[str, Any],
        header: Mapping[str, Any],
        who: str,
        counter: KeptCounter = SEARCHED,
    ) -> str:
        """Make an inspection of a complete upload, queue it and return its id.

        If that fails, the upload stays for another try.

        Args:
            name, rig, header, who: Of the inspection.
            upload_id: Of the film.
            counter: What a person has stated about the burnt-in counter.
        Raises:
            UploadNotFound, UploadIncomplete, UploadBusy: There is no complete file.
            InvalidRig: The text names field, value and the allowed values.
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has another picture size.
            PixelOutsidePicture: The box of the counter is not in the picture.
        """
        checked = checked_rig(rig)
        with self._uploads.take(upload_id) as (path, info):
            return self._create(name, path, info.filename, checked, header, who, counter)

    def import_video(
        self, path: Path, rig: Rig, name: str, header: Mapping[str, Any] | None = None
    ) -> str:
        """Copy a video file of this machine into a new inspection, queue it and return its id.

        Raises:
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        self._folder.require_room(path.stat().st_size)
        copy = self._folder.inspections / f"{secrets.token_hex(16)}.import"
        try:
            copy_durably(path, copy)  # the media process reads nothing outside the data folder
            return self._create(name, copy, path.name, rig, header or {}, "chainage")
        finally:
            copy.unlink(missing_ok=True)

    def create_from_copy(
        self,
        inspection_id: str,
        copy: Path,
        filename: str,
        rig: Mapping[str, Any],
        add: Add,
        *,
        name: str,
        header: Mapping[str, Any],
        who: str,
        priority: int,
    ) -> None:
        """Make the inspection of this id of a file in the data folder, which becomes its film, and
        queue it; what an interrupted try left of it is removed.

        Args:
            inspection_id: Id that no inspection in the database has.
            copy: The file.
            filename: Name of the film.
            rig, name, header, who, priority: Of the inspection.
            add: Adds it to the database.
        Raises:
            InvalidRig: The text names field, value and the allowed values.
            UnreadableVideo: The file is not a video that can be tracked.
            RigVideoMismatch: The rig's camera has another picture size.
        """
        self._blobs.delete_all(keys.inspection(inspection_id))
        self._create(
            name, copy, filename, checked_rig(rig), header, who,
            inspection_id=inspection_id, priority=priority, add=add,
        )  # fmt: skip

    def _create(
        self,
        name: str,
        source: Path,
        filename: str,
        rig: Rig,
        header: Mapping[str, Any],
        who: str,
        counter: KeptCounter = SEARCHED,
        *,
        inspection_id: str | None = None,
        priority: int = DESK_PRIORITY,
        add: Add | None = None,
    ) -> str:
        probed = self._media.probe(source, filename)
        rig.require_picture_size(probed.width, probed.height)
        counter.require_picture_size(probed.width, probed.height)
        inspection = self._new.new(
            name,
            rig,
            header,
            id=inspection_id or secrets.token_hex(16),
            status="queued",
            priority=priority,
            source_kind="upload",
            source_filename=filename,
            source_size=source.stat().st_size,
            source_sha256=sha256_of(source),
            video_file=file_name(probed),
            video=video_columns(probed),
        )
        with self._new.removed_unless_added(inspection):
            keep_rig(self._blobs, inspection.id, inspection.rig)
            self._blobs.adopt(keys.film(inspection.id, inspection.video_file), source)
            self._counters.put(inspection.id, counter)
            (add or self._store.add)(inspection, who)
        logger.info("Inspection %s (%s) made from %s.", inspection.id, name, filename)
        self._tracking.wake()
        return inspection.id
