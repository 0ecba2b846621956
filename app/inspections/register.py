"""The register of assets: edited one by one, imported as a table, and read by new inspections."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from app.errors import AssetNotFound, InvalidRequest
from app.storage.database.limits import require_project
from app.storage.database.tables import RegisteredAsset
from app.storage.records.assets import AssetStore, asset_of
from app.storage.records.projects import ProjectStore
from app.survey.assets import register_table
from app.survey.assets.register import Asset, completed, fields_of, one_line
from app.survey.assets.register_table import Step, Table, columns_of, fault_of_id, read_table
from app.survey.fields.declaration import Value
from app.survey.fields.header import asset_of as asset_id_of
from app.survey.folding import normalised_id
from app.survey.versions import require_version, version_of

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Import:
    """What a table does to the register."""

    table: Table
    steps: Sequence[Step]
    """Of the rows without faults."""
    alike: Mapping[int, Sequence[str]]
    """Ids that are written otherwise than the new one, by row."""


@dataclass(frozen=True)
class Alike:
    """What is known under all ways of writing an id."""

    same: Sequence[str]
    """Other ways of writing the id in the register and of inspected assets."""
    fields: Mapping[str, Value] | None
    """What a new inspection takes from the register; None if it does not have this id."""


class Register:
    """Keeps the assets of the owner's register."""

    def __init__(self, store: AssetStore, projects: ProjectStore) -> None:
        self._store = store
        self._projects = projects

    def make_project(self, name: str, who: str) -> None:
        """Make a project, to which nothing belongs yet; one that is known stays as it is.

        Raises:
            Forbidden: The token is limited to other projects.
        """
        require_project(name)
        self._projects.make(name, who)
        logger.info("%s made the project %r.", who, name)

    def delete_project(self, name: str, who: str) -> None:
        """Take a project back that was made; what belongs to it keeps its name."""
        self._projects.delete(name)
        logger.info("%s took the project %r back.", who, name)

    def get(self, asset_id: str) -> RegisteredAsset:
        """Return an asset.

        Raises:
            AssetNotFound: The register has no asset with this id.
        """
        row = self._store.find(one_line(asset_id))
        if row is None:
            raise AssetNotFound(f"The register has no asset {asset_id!r}.")
        return row

    def page(self, text: str, offset: int, limit: int) -> tuple[int, list[RegisteredAsset]]:
        """Return the number of assets with these words, and some of them, sorted by id."""
        return self._store.page(text, offset, limit)

    def put(self, asset: Asset, who: str, replaced: str | None) -> RegisteredAsset:
        """Add an asset, or replace the one with its id.

        Raises:
            InvalidRequest: The id has no letter or digit.
            ChangedMeanwhile: The stored version is no longer `replaced`; nothing was stored.
        """
        if fault := fault_of_id(asset.asset_id):
            raise InvalidRequest(f"{fault.capitalize()}.")

        def require(stored: Asset | None) -> None:
            require_version(None if stored is None else _plain(stored), _plain(asset), replaced)

        row = self._store.put(asset, who, require)
        logger.info("%s put asset %r into the register.", who, asset.asset_id)
        return row

    def delete(self, asset_id: str, who: str, replaced: str | None) -> None:
        """Take an asset off the register; its inspections stay.

        Raises:
            AssetNotFound: The register has no asset with this id.
            ChangedMeanwhile: The stored version is no longer `replaced`; nothing was deleted.
        """

        def require(stored: Asset) -> None:
            require_version(_plain(stored), None, replaced)

        registered_id = one_line(asset_id)
        self._store.delete(registered_id, require)
        logger.info("%s took asset %r off the register.", who, registered_id)

    def table(self) -> Iterator[str]:
        """Yield the register as a table, piece by piece."""
        return register_table.written(self._store.every())

    def preview(self, content: bytes, columns: Sequence[str] = ()) -> Import:
        """Return what the import of a table would do; nothing changes.

        Args:
            content: The file.
            columns: What its columns hold, as `columns_of` takes it; by default it is guessed.
        Raises:
            InvalidTable: The content is no table, or the columns are not those of the table.
        """
        table = read_table(content, columns_of(columns))
        return self._import(table, self._store.steps(table.stated))

    def take(self, content: bytes, columns: Sequence[str], who: str) -> Import:
        """Import the rows of a table that have no fault.

        Raises:
            InvalidTable: As `preview`; nothing is stored.
        """
        table = read_table(content, columns_of(columns))
        done = self._store.take(table.stated, who)
        logger.info("%s imported a table of %d assets.", who, len(done))
        return self._import(table, done)

    def alike(self, asset_id: str) -> Alike:
        """Return the other ways of writing an id, and what is registered under it."""
        wanted = one_line(asset_id)
        if not wanted:
            return Alike((), None)
        alike = self._store.ids_alike([wanted]).get(normalised_id(wanted), [])
        row = self._store.find(wanted)
        fields = None if row is None else fields_of(asset_of(row))
        return Alike([other for other in alike if other != wanted], fields)

    def completed(self, header: Mapping[str, Any]) -> dict[str, Any]:
        """Return the header of a new inspection, its empty fields filled from the register, and
        its id written as there, so that it is the same asset.
        """
        asset_id = asset_id_of(header)
        row = None if asset_id is None else self._store.find(one_line(asset_id))
        if row is None:
            return completed(header, None)
        return completed(header, asset_of(row)) | {"asset_id": row.asset_id}

    def _import(self, table: Table, steps: Sequence[Step]) -> Import:
        added = [step for step in steps if step.action == "add"]
        by_id = self._store.ids_alike(step.asset.asset_id for step in added)
        for step in added:  # two new rows of the table may be alike, too
            ids = by_id.setdefault(normalised_id(step.asset.asset_id), [])
            if step.asset.asset_id not in ids:
                ids.append(step.asset.asset_id)
        alike = {
            step.row: others
            for step in added
            if (others := _others(by_id[normalised_id(step.asset.asset_id)], step.asset.asset_id))
        }
        return Import(table, steps, alike)


def version_of_asset(row: RegisteredAsset) -> str:
    """Return the version of an asset, which guards against changes of others."""
    return version_of(_plain(asset_of(row)))


def _plain(asset: Asset) -> dict[str, Any]:
    return asdict(asset) | {"line": [list(point) for point in asset.line]}


def _others(ids: Sequence[str], asset_id: str) -> list[str]:
    return [other for other in ids if other != asset_id]
