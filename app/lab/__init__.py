"""What is measured away from the field: rendered culverts, peers, accuracy, calibration."""
