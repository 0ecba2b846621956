"""The models of users in the database; the files are blobs."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, String, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from app.errors import DetectorNameTaken, DetectorNotFound
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import Base
from app.survey.findings.records import CLASSICAL


class DetectorRow(Base):
    """A model that proposes findings."""

    __tablename__ = "detectors"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(100), unique=True)
    sha256: Mapped[str] = mapped_column(String(64))
    size: Mapped[int] = mapped_column(BigInteger)
    declared: Mapped[dict[str, Any]]
    """`app.survey.findings.declaration.Declaration`."""
    created_at: Mapped[datetime]
    created_by: Mapped[str] = mapped_column(String(100))


class DetectorStore(Store):
    """Returns detached rows; a model is never changed, only added and deleted."""

    @reading
    def all(self, session: Session) -> list[DetectorRow]:
        """Return all models, sorted by name."""
        return list(session.scalars(select(DetectorRow).order_by(DetectorRow.name)))

    @reading
    def get(self, session: Session, detector_id: str) -> DetectorRow:
        """Return the model with this id.

        Raises:
            DetectorNotFound: There is none.
        """
        return _existing(session, detector_id)

    @reading
    def require_free(self, session: Session, name: str) -> None:
        """Raise DetectorNameTaken if a model has this name."""
        _require_free(session, name)

    @writing
    def add(self, session: Session, row: DetectorRow) -> None:
        """Add a model; raise DetectorNameTaken if another one has its name."""
        _require_free(session, row.name)
        session.add(row)

    @writing
    def delete(self, session: Session, detector_id: str) -> None:
        """Delete a model; raise DetectorNotFound if there is none."""
        session.delete(_existing(session, detector_id))


def _existing(session: Session, detector_id: str) -> DetectorRow:
    row = session.get(DetectorRow, detector_id)
    if row is None:
        raise DetectorNotFound("There is no such model; it may have been deleted.")
    return row


def _require_free(session: Session, name: str) -> None:
    same = select(DetectorRow.id).where(DetectorRow.name == name)
    if name == CLASSICAL or session.scalar(same):
        raise DetectorNameTaken(f"There is a detector named {name!r} already.")
