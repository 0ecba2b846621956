"""The defect location report: one model of it, and a module for every form that it leaves in."""
