"""The project of an inspection in a column of its own, by which tokens are limited."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_NAMES = ("project", "job_ref", "client_job_ref")


def upgrade() -> None:
    """Add the column, and fill it from the headers."""
    op.add_column("inspections", sa.Column("project", sa.Text()))
    op.create_index("ix_inspections_project", "inspections", ["project"])
    table = sa.table(
        "inspections",
        sa.column("id", sa.String(32)),
        sa.column("header", sa.JSON()),
        sa.column("project", sa.Text()),
    )
    connection = op.get_bind()
    rows = connection.execute(sa.select(table.c.id, table.c.header)).all()
    named = [
        {"of": inspection_id, "named": project}
        for inspection_id, header in rows
        if (project := _project_of(header))
    ]
    if named:
        change = (
            sa.update(table)
            .where(table.c.id == sa.bindparam("of"))
            .values(project=sa.bindparam("named"))
        )
        connection.execute(change, named)


def _project_of(header: dict[str, object]) -> str | None:
    texts = (str(header[name]).strip() for name in _NAMES if header.get(name) is not None)
    found = next((text for text in texts if text), None)
    return found and found.replace("\x00", "\ufffd")[:500]
