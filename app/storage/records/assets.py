"""The register of assets in the database."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any

from sqlalchemy import Executable, func, insert, select, union, update
from sqlalchemy.orm import Session

from app.errors import AssetNotFound, Busy
from app.storage.database.database import batches
from app.storage.database.store import Store, reading, writing
from app.storage.database.tables import IndexedInspection, RegisteredAsset
from app.storage.index.queries import a_page, with_words
from app.survey.assets.box import box_around
from app.survey.assets.register import Asset, texts_of
from app.survey.assets.register_table import Stated, Step, steps
from app.survey.assets.search_terms import Page
from app.survey.folding import folded, normalised_id
from app.survey.versions import Require

_AT_ONCE = 1_000
_TRIES = 5
"""How often an import is planned anew because somebody has changed the register meanwhile."""


class AssetStore(Store):
    """Returns detached rows."""

    @reading
    def state(self, session: Session) -> Hashable:
        """Return what differs after every change of the register."""
        return _state(session)

    @reading
    def find(self, session: Session, asset_id: str) -> RegisteredAsset | None:
        """Return the asset of this id, None if the register does not have it."""
        return session.get(RegisteredAsset, asset_id)

    @reading
    def page(
        self, session: Session, text: str, offset: int, limit: int
    ) -> tuple[int, list[RegisteredAsset]]:
        """Return the number of assets with these words, and some of them, sorted by id."""
        query = select(RegisteredAsset).where(*with_words(RegisteredAsset.folded, text))
        page = Page(sort="asset_id", descending=False, offset=offset, limit=limit)
        total, found = a_page(session, query, (RegisteredAsset.asset_id.asc(),), page)
        return total, [row for (row,) in found]

    def every(self) -> Iterator[Asset]:
        """Yield all assets, sorted by id, reading some at a time."""
        last = ""
        while True:
            query = (
                select(RegisteredAsset)
                .where(RegisteredAsset.asset_id > last)
                .order_by(RegisteredAsset.asset_id)
                .limit(_AT_ONCE)
            )
            with self.database.read() as session:
                rows = list(session.scalars(query))
            if not rows:
                return
            yield from map(asset_of, rows)
            last = rows[-1].asset_id

    @writing
    def put(self, session: Session, asset: Asset, who: str, require: Require) -> RegisteredAsset:
        """Add an asset, or replace the one with its id; return its row.

        Raises:
            Exception: Whatever `require` raises for the stored asset, None if there is none.
        """
        row = session.get(RegisteredAsset, asset.asset_id)
        require(None if row is None else asset_of(row))
        _place_again(session, {asset.asset_id: [list(point) for point in asset.line]})
        return session.merge(RegisteredAsset(**columns_of(asset, who, datetime.now(UTC))))

    @writing
    def delete(self, session: Session, asset_id: str, require: Require) -> None:
        """Take an asset off the register; its inspections stay.

        Raises:
            AssetNotFound: The register has no asset with this id.
            Exception: Whatever `require` raises for the stored asset.
        """
        row = session.get(RegisteredAsset, asset_id)
        if row is None:
            raise AssetNotFound("There is no such asset in the register.")
        require(asset_of(row))
        _place_again(session, {asset_id: []})
        session.delete(row)

    @reading
    def steps(self, session: Session, stated: Sequence[Stated]) -> list[Step]:
        """Return what an import would do; nothing changes."""
        return steps(stated, _known(session, stated))

    def take(self, stated: Sequence[Stated], who: str) -> list[Step]:
        """Add and change assets in one transaction; return what was done.

        Raises:
            Busy: Others keep changing the register.
        """
        for _ in range(_TRIES):
            # Planned before the transaction: other writes, such as tags, wait for its end.
            with self.database.read() as session:
                state, done = _state(session), steps(stated, _known(session, stated))
            now = datetime.now(UTC)
            added, changed = (
                [columns_of(step.asset, who, now) for step in done if step.action == action]
                for action in ("add", "change")
            )
            if self.database.write(partial(_applied, state, added, changed)):
                return done
        raise Busy("Others keep changing the register; import the table again in a moment.")

    @reading
    def ids_alike(self, session: Session, asset_ids: Iterable[str]) -> dict[str, list[str]]:
        """Return the ids in the register, and of inspected assets, that have the normalised id
        of one of these, by normalised id.
        """
        found: dict[str, list[str]] = {}
        for some in batches({normalised_id(asset_id) for asset_id in asset_ids}):
            known = select(RegisteredAsset.normalised_id, RegisteredAsset.asset_id).where(
                RegisteredAsset.normalised_id.in_(some)
            )
            inspected = select(
                IndexedInspection.asset_normalised_id, IndexedInspection.asset
            ).where(IndexedInspection.asset_normalised_id.in_(some))
            both: Executable = union(known, inspected).order_by("asset_id")
            for normalised, asset_id in session.execute(both):
                found.setdefault(normalised, []).append(asset_id)
        return found


def asset_of(row: RegisteredAsset) -> Asset:
    """Return what a row says of its asset."""
    line = tuple((lon, lat) for lon, lat in row.line)
    return Asset(row.asset_id, row.project, row.header, line)


def columns_of(asset: Asset, who: str, now: datetime) -> dict[str, Any]:
    """Return the row of an asset."""
    normalised = normalised_id(asset.asset_id)
    return {
        "asset_id": asset.asset_id,
        "normalised_id": normalised,
        "project": asset.project,
        "header": dict(asset.header),
        "line": [list(point) for point in asset.line],
        **box_around(asset.line),
        "folded": folded(normalised, *texts_of(asset)),
        "changed_at": now,
        "changed_by": who,
    }


def _applied(
    state: Hashable, added: list[dict[str, Any]], changed: list[dict[str, Any]], session: Session
) -> bool:
    """Insert and update rows, unless the register is no longer in the state of the plan."""
    if _state(session) != state:
        return False
    _place_again(session, {row["asset_id"]: row["line"] for row in (*added, *changed)})
    for change, rows in ((insert, added), (update, changed)):
        if rows:
            session.execute(change(RegisteredAsset), rows)
    return True


def _place_again(session: Session, lines: Mapping[str, list[list[float]]]) -> None:
    """Have the inspections of those assets indexed again that are to get another line."""
    for some in batches(lines):
        is_of = RegisteredAsset.asset_id.in_(some)
        query = select(RegisteredAsset.asset_id, RegisteredAsset.line).where(is_of)
        stored = {asset_id: line for asset_id, line in session.execute(query)}  # noqa: C416
        moved = [asset_id for asset_id in some if stored.get(asset_id, []) != lines[asset_id]]
        indexed = IndexedInspection.asset.in_(moved)
        session.execute(update(IndexedInspection).where(indexed).values(index_version=0))


def _state(session: Session) -> Hashable:
    """Return what differs after every change of the register."""
    query = select(func.count(), func.max(RegisteredAsset.changed_at)).select_from(RegisteredAsset)
    return tuple(session.execute(query).one())


def _known(session: Session, stated: Sequence[Stated]) -> Mapping[str, Asset]:
    """Return the registered ones of the stated assets, by id."""
    return {
        row.asset_id: asset_of(row)
        for some in batches(row.asset_id for row in stated)
        for row in session.scalars(
            select(RegisteredAsset).where(RegisteredAsset.asset_id.in_(some))
        )
    }
