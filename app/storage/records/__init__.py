"""Stores of what people state and what tracking found, a module for each kind."""
