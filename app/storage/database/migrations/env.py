"""Runs the migrations on the connection that `database.py` hands over."""

from alembic import context

from app.storage.database.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,  # SQLite alters a table by copying it
    transactional_ddl=True,  # `database.py` has begun the one transaction
)
with context.begin_transaction():
    context.run_migrations()
