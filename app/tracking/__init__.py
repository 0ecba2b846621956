"""From a film or a camera to a track: the queue, the child processes, and their results."""
