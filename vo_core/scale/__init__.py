"""Scale of a finished track, and the uncertainty of its distances."""
