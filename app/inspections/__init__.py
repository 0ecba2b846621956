"""Inspections and what people state about them: observations, corrections, imports, uploads."""
