"""Files of the data folder itself: its lock, tokens, uploads and unfinished imports."""
