"""The films of the archive that wait to become inspections."""
