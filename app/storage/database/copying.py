"""Copies every row of a database into one of the other kind, table by table.

The tables are those that both databases have, not those of the code: so a copy of an older revision
is whole too.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import JSON, Column, Connection, MetaData, Table, event, select

_REVISION = "alembic_version"
_ROWS_AT_ONCE = 1000


def copy_rows(source: Connection, target: Connection) -> None:
    """Copy all rows into empty tables of the same revision, within one transaction of each.

    Args:
        source: Sees one state until the end.
        target: Has the tables of the same revision, without rows.
    """
    found = _tables(source)
    reading = source.execution_options(stream_results=True, yield_per=_ROWS_AT_ONCE)
    for table in _tables(target).sorted_tables:  # what a reference points to comes first
        if table.name != _REVISION:
            columns = [found.tables[table.name].columns[column.name] for column in table.columns]
            for rows in reading.execute(select(*columns)).mappings().partitions():
                target.execute(table.insert(), [dict(row) for row in rows])


def numbered_columns(connection: Connection) -> list[Column[int]]:
    """Return the columns whose numbers the database assigns."""
    columns = [table.autoincrement_column for table in _tables(connection).sorted_tables]
    return [column for column in columns if column is not None]


def _tables(connection: Connection) -> MetaData:
    tables = MetaData()
    event.listen(tables, "column_reflect", _write_nothing_as_null)
    tables.reflect(connection)
    return tables


def _write_nothing_as_null(_inspector: object, _table: Table, column: dict[str, Any]) -> None:
    """Keep None in a JSON column SQL's NULL, as the code's tables do."""
    if isinstance(column["type"], JSON):
        column["type"] = JSON(none_as_null=True)
