"""What looks across all inspections: the index, the search, and the export of everything."""
