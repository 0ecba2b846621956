"""The register in the database while several people change it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from app.storage.database.database import Database
from app.storage.records.assets import AssetStore
from app.survey.assets.register import Asset, registered
from app.survey.assets.register_table import Stated, read_table

CLAY = registered("CV-01", None, {"material": "clay"}, ())


class Interrupted(list[Stated]):
    """Rows of a table; when they have been compared with the register, somebody adds an asset."""

    def __init__(self, rows: list[Stated], store: AssetStore) -> None:
        super().__init__(rows)
        self._store = store
        self._times_read = 0

    def __iter__(self) -> Iterator[Stated]:
        yield from super().__iter__()
        self._times_read += 1
        if self._times_read == 2:  # first to find the known ones, then to compare
            self._store.put(CLAY, "somebody", lambda _stored: None)


def test_an_import_keeps_what_somebody_adds_while_it_is_planned(tmp_path: Path) -> None:
    database = Database(tmp_path / "chainage.db")
    store = AssetStore(database)
    table = read_table(b"asset_id,height_mm\nCV-01,600\nCV-02,700\n")
    done = store.take(Interrupted(list(table.stated), store), "me")
    assert [step.action for step in done] == ["change", "add"]
    assert list(store.every()) == [
        Asset("CV-01", None, {"height_mm": 600, "material": "clay"}),
        Asset("CV-02", None, {"height_mm": 700}),
    ]
    database.close()
