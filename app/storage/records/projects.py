"""Projects that people made; others are known by what belongs to them."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import delete
from sqlalchemy.orm import Session

from app.storage.database.store import Store, writing
from app.storage.database.tables import MadeProject
from app.survey.folding import folded


class ProjectStore(Store):
    """Makes projects, and takes them back."""

    @writing
    def make(self, session: Session, name: str, who: str) -> None:
        """Make a project; one that was made before stays as it is."""
        if session.get(MadeProject, name) is None:
            now = datetime.now(UTC)
            session.add(MadeProject(name=name, folded=folded(name), made_at=now, made_by=who))

    @writing
    def delete(self, session: Session, name: str) -> None:
        """Take a project back; what belongs to it keeps its name, and so the project."""
        session.execute(delete(MadeProject).where(MadeProject.name == name))
