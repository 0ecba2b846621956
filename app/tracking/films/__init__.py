"""Has films tracked: the queue, its engines, and what a run leaves."""
