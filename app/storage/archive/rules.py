"""The rules of the archive: one row."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy.orm import Session

from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import ArchiveRules
from app.survey.versions import Require


class RuleStore(Store):
    """Keeps the rules as people stated them last."""

    @reading
    def get(self, session: Session) -> dict[str, Any] | None:
        """Return the stored rules; None if there never were any."""
        row = session.get(ArchiveRules, 1)
        return None if row is None else row.content

    @writing
    def put(self, session: Session, content: dict[str, Any], who: str, require: Require) -> None:
        """Replace the rules.

        Raises:
            Exception: Whatever `require` raises for the stored content, None if there is none.
        """
        row = session.get(ArchiveRules, 1)
        require(None if row is None else row.content)
        session.merge(
            ArchiveRules(id=1, content=content, changed_at=datetime.now(UTC), changed_by=who)
        )
