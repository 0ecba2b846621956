"""Findings on the unrolled wall: their search, what people decide, the models of users."""
