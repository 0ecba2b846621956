"""Questions about all inspections: the index of defects, the assets, the list."""
