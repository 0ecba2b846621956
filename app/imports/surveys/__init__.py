"""Surveys of other programs: readers of their formats, and how their texts become fields."""
