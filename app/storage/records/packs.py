"""Versions of code packs in the database, beside the built-in one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import PackInUse, PackNameTaken, PackNotFound
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import CodePack, Inspection
from app.survey.fields.header import project_of

_NOT_FOUND = "There is no such code pack; it may have been deleted."


class PackStore(Store):
    """Returns detached rows; a version is never changed, only added and deleted."""

    @reading
    def all(self, session: Session) -> list[CodePack]:
        """Return all versions, sorted by title, the newest first."""
        order = (func.lower(CodePack.title), CodePack.title, CodePack.version.desc())
        return list(session.scalars(select(CodePack).order_by(*order)))

    @reading
    def users(self, session: Session) -> dict[str, int]:
        """Return by id of a pack how many inspections are coded with it."""
        used = select(Inspection.header["code_pack"].as_string().label("pack")).subquery()
        rows = session.execute(select(used.c.pack, func.count()).group_by(used.c.pack))
        return {pack: count for pack, count in rows if pack}

    @reading
    def get(self, session: Session, pack_id: str) -> CodePack:
        """Return the pack with this id.

        Raises:
            PackNotFound: No pack has this id.
        """
        return existing(session, pack_id)

    @writing
    def add(self, session: Session, pack: CodePack) -> None:
        """Add the next version of what its title names; `pack` can then be used like a result of
        get().

        Raises:
            PackNameTaken: The title is of another project, its newest version has the same table,
                or another pack is named like the new version.
        """
        newest = session.scalar(
            select(CodePack)
            .where(CodePack.title == pack.title)
            .order_by(CodePack.version.desc())
            .limit(1)
        )
        if newest is not None:
            if newest.project != pack.project:
                whose = f"the project {newest.project!r}" if newest.project else "all projects"
                raise PackNameTaken(
                    f"There is a code pack named {pack.title!r} for {whose}; choose another name."
                )
            if newest.table == pack.table:
                raise PackNameTaken(f"The table is that of {newest.name!r}, which is there.")
            pack.version = newest.version + 1
        pack.name = name_of(pack.title, pack.version)
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


def name_of(title: str, version: int) -> str:
    """Return the name of a version as reports print it."""
    return title if version == 1 else f"{title} v{version}"


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
    """Check, within the session that stores a header, that the pack it names is for its project.

    Raises:
        PackNotFound: The pack does not exist, or belongs to another project.
    """
    pack_id = header.get("code_pack")
    if pack_id:
        require_offered(existing(session, pack_id), header)


def require_offered(pack: CodePack, header: Mapping[str, Any]) -> None:
    """Check that inspections with this header may be coded with a pack.

    Raises:
        PackNotFound: It belongs to another project.
    """
    if pack.project is not None and pack.project != project_of(header):
        raise PackNotFound(
            f"The code pack {pack.name!r} belongs to the project {pack.project!r} alone."
        )
