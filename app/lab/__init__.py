"""Measurements in the laboratory: rendered culverts, peers, accuracy, calibration."""
