"""Pictures, clips and burnt-in counters of films, read by child processes."""
