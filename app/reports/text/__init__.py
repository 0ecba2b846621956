"""Text for every format: what can be shown, in which font, in ASCII, and as the name of a file."""
