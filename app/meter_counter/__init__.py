"""Chainage as the meter counter of other software."""
