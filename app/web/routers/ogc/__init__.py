"""OGC API Features: what geographic information systems open as layers."""
