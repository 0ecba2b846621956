"""Code packs in the database, beside the built-in one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import PackInUse, PackNameTaken, PackNotFound
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import CodePack, Inspection

_NOT_FOUND = "There is no such code pack; it may have been deleted."


class PackStore(Store):
    """Returns detached rows; a pack is never changed, only added and deleted."""

    @reading
    def all(self, session: Session) -> list[CodePack]:
        """Return all packs, sorted by name."""
        return list(session.scalars(select(CodePack).order_by(CodePack.name)))

    @reading
    def get(self, session: Session, pack_id: str) -> CodePack:
        """Return the pack with this id.

        Raises:
            PackNotFound: No pack has this id.
        """
        return existing(session, pack_id)

    @writing
    def add(self, session: Session, pack: CodePack) -> None:
        """Add a new pack; `pack` can then be used like a result of get().

        Raises:
            PackNameTaken: Another pack has this name.
        """
        if session.scalar(select(CodePack.id).where(CodePack.name == pack.name)):
            raise PackNameTaken(
                f"There is a code pack named {pack.name!r} already; choose another name."
            )
        session.add(pack)

    @writing
    def delete(self, session: Session, pack_id: str) -> None:
        """Delete a pack.

        Raises:
            PackNotFound: No pack has this id.
            PackInUse: An inspection uses the pack.
        """
        pack = existing(session, pack_id)
        users = session.scalar(
            select(func.count()).where(Inspection.header["code_pack"].as_string() == pack_id)
        )
        if users:
            number = "An inspection is" if users == 1 else f"{users} inspections are"
            raise PackInUse(f"{number} coded with the pack {pack.name!r}, so it cannot be deleted.")
        session.delete(pack)


def existing(session: Session, pack_id: str) -> CodePack:
    """Return the row of this id, within a session.

    Raises:
        PackNotFound: No pack has this id.
    """
    pack = session.get(CodePack, pack_id)
    if pack is None:
        raise PackNotFound(_NOT_FOUND)
    return pack


def require_pack_of(session: Session, header: Mapping[str, Any]) -> None:
    """Check, within the session that stores a header, that the pack it names exists.

    Raises:
        PackNotFound: The pack does not exist.
    """
    pack_id = header.get("code_pack")
    if pack_id:
        existing(session, pack_id)
