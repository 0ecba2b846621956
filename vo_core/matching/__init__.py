"""Comparison of two pictures: phase correlation and direct alignment."""
