"""SQLite or PostgreSQL: the tables, the one thread that writes, copies and backups."""
