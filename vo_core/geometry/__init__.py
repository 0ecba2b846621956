"""Camera, mount and pipe: rays, the developed wall, motion on it."""
