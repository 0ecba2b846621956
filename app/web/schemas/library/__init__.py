"""Answers over many inspections, and about what several of them use."""
