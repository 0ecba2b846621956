"""Measures what the search of the wall finds, on walls and pictures of known truth."""
