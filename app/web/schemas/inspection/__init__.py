"""Answers about one inspection, and the list of them."""
