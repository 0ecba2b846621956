"""Many films at once: rules that give them rigs, and their turn to become inspections."""
