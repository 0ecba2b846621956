"""Shared content of the reports that people read: words, axis, placement of labels."""
