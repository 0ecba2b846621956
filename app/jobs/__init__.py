"""Child processes, which decode and track media; the server never does."""
