"""The defect location report: one model, and one module for each output format."""
