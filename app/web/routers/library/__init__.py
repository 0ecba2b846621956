"""Routes over many inspections, and of what several of them use."""
