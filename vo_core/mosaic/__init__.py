"""The unrolled wall: one picture of all that a run has shown."""
