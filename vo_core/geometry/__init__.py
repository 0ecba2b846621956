"""Geometry of camera, mount and pipe: rays, the developed wall, and motion on it."""
