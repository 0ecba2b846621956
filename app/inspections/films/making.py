"""What every new inspection needs, whatever its film comes from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from typing import Any

from app.errors import DiskFull, NoLongerWanted, StoreUnavailable
from app.inspections.register import Register
from app.storage.blobs import keys
from app.storage.blobs.blobs import Blobs
from app.storage.database.limits import require_project
from app.storage.database.tables import Inspection
from app.survey.fields.header import project_of
from vo_core import Rig
from vo_core.geometry.rectify import require_wall_in_view


class NewInspections:
    """Makes the rows of inspections, and stores what lies beside their films."""

    def __init__(self, blobs: Blobs, register: Register) -> None:
        self._blobs = blobs
        self._register = register

    def new(self, name: str, rig: Rig, header: Mapping[str, Any], **source: Any) -> Inspection:
        """Return a new inspection, whose header has what the register knows of its asset.

        Raises:
            Forbidden: The token that makes it is limited to other projects.
        """
        completed = self._register.completed(header)
        require_project(project_of(completed))
        return Inspection(
            name=name,
            rig=rig.model_dump(mode="json"),
            header=completed,
            frames_done=0,
            created_at=datetime.now(UTC),
            queued_at=datetime.now(UTC),
            **source,
        )

    @contextmanager
    def removed_unless_added(self, inspection: Inspection) -> Iterator[None]:
        """Remove the blobs of a new inspection again if the block fails."""
        try:
            yield
        except (OSError, DiskFull, StoreUnavailable, NoLongerWanted):
            with suppress(OSError, StoreUnavailable):
                self._blobs.delete_all(keys.inspection(inspection.id))
            raise


def keep_rig(blobs: Blobs, inspection_id: str, rig: Mapping[str, Any]) -> None:
    """Store the rig beside the film; the database has it too."""
    blobs.put(keys.rig(inspection_id), json.dumps(rig, indent=2).encode())


def checked_rig(rig: Mapping[str, Any]) -> Rig:
    """Parse a stated rig; raise InvalidRig if its camera cannot see the wall."""
    checked = Rig.parse(dict(rig))
    require_wall_in_view(checked)
    return checked
