"""Each person's choices for the page, in the database."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import CodePack, Preference
from app.storage.records.packs import existing


class PreferenceStore(Store):
    """Holds one row for each person, by the name of the token."""

    @reading
    def get(self, session: Session, who: str) -> dict[str, Any]:
        """Return the choices; empty before the first one, and without a pack that was deleted."""
        row = session.get(Preference, who)
        chosen = {} if row is None else dict(row.chosen)
        pack_id = chosen.get("pack")
        if pack_id and session.get(CodePack, pack_id) is None:
            chosen["pack"] = None
        return chosen

    @writing
    def put(self, session: Session, who: str, chosen: Mapping[str, Any]) -> None:
        """Replace all choices.

        Raises:
            PackNotFound: The chosen pack does not exist.
        """
        if chosen["pack"]:
            existing(session, chosen["pack"])
        session.merge(Preference(who=who, chosen=dict(chosen)))
