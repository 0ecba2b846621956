"""Inspections that come as files: of other programs, and of other servers."""
