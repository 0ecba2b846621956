"""Time stamps of a film, exact or as a network delivers them."""

from __future__ import annotations

import numpy as np

from app.lab.simulation.scenario import BURST_S, Scenario

TICKS_PER_S = 90_000
"""Time base of the film, as in MPEG-TS and RTP."""

_LEAST_STEP_S = 0.001
"""Least interval between frames that wait for each other in a queue."""


def time_stamps(scenario: Scenario, frames: int) -> list[float]:
    """Time of each frame in seconds, rising from 0, in whole ticks of the film."""
    rng = np.random.default_rng([scenario.seed, 5])
    nominal_s = np.arange(frames) / scenario.frames_per_s
    stamps_s = nominal_s + rng.uniform(0, scenario.late_s, frames)
    if scenario.burst_frame is not None and scenario.burst_frame + 1 < frames:
        stamps_s[scenario.burst_frame] = stamps_s[scenario.burst_frame + 1] - BURST_S
    # A frame waits for the one before it.
    waits_s = _LEAST_STEP_S * np.arange(frames)
    stamps_s = np.maximum.accumulate(stamps_s - waits_s) + waits_s
    ticks = np.rint((stamps_s - stamps_s[:1]) * TICKS_PER_S)
    seconds: list[float] = (ticks / TICKS_PER_S).tolist()
    return seconds
