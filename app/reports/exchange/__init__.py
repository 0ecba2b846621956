"""Reports for other programs: EN 13508-2 text, RIBX, ISYBAU XML, DWA-M 150 and GeoJSON."""
