"""Findings, the proposals of detectors: what is kept of them, and how they become observations."""
