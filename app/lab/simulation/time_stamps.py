"""When frames and rows are exposed, and time stamps as a network delivers them."""

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


def row_delays_s(scenario: Scenario) -> list[float]:
    """Exposure time of each row relative to the frame's time; one number if all rows are equal.

    The time of an interlaced frame is that of its upper field, which holds the even rows; with a
    rolling shutter it is that of the middle row.
    """
    camera = scenario.rendered_rig.camera
    rows = np.arange(camera.height)
    delays_s = camera.readout_ms / 1000 * (rows / camera.height - 0.5)
    if scenario.interlaced:
        delays_s = delays_s + rows % 2 / (2 * scenario.frames_per_s)
    return delays_s.tolist() if delays_s.any() else [0.0]
