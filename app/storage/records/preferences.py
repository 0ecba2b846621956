"""Each person's choices for the page, in the database."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy.orm import Session

from app.storage.database.database import Database
from app.storage.database.tables import CodePack, Preference
from app.storage.records.packs import existing


class PreferenceStore:
    """Holds one row for each person, by the name of the token."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, who: str) -> dict[str, Any]:
        """Return the choices; empty before the first one, and without a pack that was deleted."""
        with self._database.read() as session:
            row = session.get(Preference, who)
            chosen = {} if row is None else dict(row.chosen)
            pack_id = chosen.get("pack")
            if pack_id and session.get(CodePack, pack_id) is None:
                chosen["pack"] = None
            return chosen

    def put(self, who: str, chosen: Mapping[str, Any]) -> None:
        """Replace all choices.

        Raises:
            PackNotFound: The chosen pack does not exist.
        """

        def replace(session: Session) -> None:
            if chosen["pack"]:
                existing(session, chosen["pack"])
            session.merge(Preference(who=who, chosen=dict(chosen)))

        self._database.write(replace)
