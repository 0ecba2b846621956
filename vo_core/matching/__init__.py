"""Two pictures against each other: phase correlation and direct alignment."""
