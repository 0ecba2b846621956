"""The signed evidence bundle: written, and verified."""
