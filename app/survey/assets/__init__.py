"""Assets across their inspections: register, history and search."""
