"""Inspections, their films, and what people state about them: rules over stored data."""
