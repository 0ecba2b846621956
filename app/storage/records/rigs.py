"""The library of rigs in the database."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.errors import RigNameTaken, RigNotFound
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import Inspection, LibraryRig


@dataclass(frozen=True)
class RigUser:
    """An inspection whose header names a rig."""

    id: str
    name: str


class RigStore(Store):
    """Returns detached rows."""

    @reading
    def all(self, session: Session) -> list[tuple[LibraryRig, list[RigUser]]]:
        """Return the rigs by name, each with the inspections whose header names it, newest
        first.
        """
        rigs = list(session.scalars(select(LibraryRig).order_by(LibraryRig.name)))
        users: dict[str, list[RigUser]] = {rig.name: [] for rig in rigs}
        named = Inspection.header["rig_id"].as_string()
        rows = session.execute(
            select(named, Inspection.id, Inspection.name)
            .where(named.in_(users))
            .order_by(Inspection.created_at.desc())
        )
        for rig_name, inspection_id, name in rows:
            users[rig_name].append(RigUser(inspection_id, name))
        return [(rig, users[rig.name]) for rig in rigs]

    @writing
    def put(self, session: Session, rig: LibraryRig) -> None:
        """Add a rig, or replace the one with its id.

        Raises:
            RigNameTaken: Another rig has this name.
        """
        same_name = select(LibraryRig.id).where(LibraryRig.name == rig.name)
        if session.scalar(same_name.where(LibraryRig.id != rig.id)):
            raise RigNameTaken(f"There is a rig named {rig.name!r} already; choose another name.")
        session.merge(rig)

    @writing
    def delete(self, session: Session, rig_id: str) -> None:
        """Take a rig off the library; inspections keep their own copies.

        Raises:
            RigNotFound: No rig has this id.
        """
        rig = session.get(LibraryRig, rig_id)
        if rig is None:
            raise RigNotFound("There is no such rig; it may have been deleted.")
        session.delete(rig)
