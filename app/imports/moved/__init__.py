"""Inspections that move between servers: the report in JSON, and the archive file."""
