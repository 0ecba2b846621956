"""The state of the server, for people and programs that watch it: health and metrics."""
