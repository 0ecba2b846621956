"""Synthetic tracks, and the rings that a camera sees along them."""

from __future__ import annotations

import numpy as np

from vo_core import Track
from vo_core.joints.sightings import Sighting

SEGMENT_MM = 1500.0
TRUE_MM = np.linspace(0, 6000, 301)


def straight_track(x_mm, sigma_mm=None):
    """Return a track without errors."""
    count = len(x_mm)
    zero = np.zeros(count)
    return Track(
        np.arange(count), np.arange(count) / 30, x_mm, zero, zero, x_mm,
        zero if sigma_mm is None else sigma_mm, np.ones(count), np.array(["ok"] * count),
        zero if sigma_mm is None else sigma_mm, zero, zero, zero, zero,
    )  # fmt: skip


def make_track(distance_mm, sigma_mm, status=None):
    count = len(distance_mm)
    return Track(
        frame=np.arange(count),
        time_s=np.arange(count) / 30,
        x_mm=distance_mm,
        y_mm=np.sin(np.arange(count)),
        yaw_deg=np.cos(np.arange(count)),
        distance_mm=distance_mm,
        sigma_distance_mm=sigma_mm,
        quality=np.full(count, 0.9),
        status=np.array(["ok"] * count if status is None else status),
        sigma_registration_mm=sigma_mm,
        **dict.fromkeys(("z_mm", "pitch_deg", "roll_deg", "looking_around"), np.zeros(count)),
    )


def look(track, at_mm):
    """Return sightings of rings at places along the track, one for each pass of the camera."""
    found = []
    for at in at_mm:
        passes = np.flatnonzero(np.diff(np.sign(track.distance_mm - at)))
        found += [Sighting(int(n), float(at - track.distance_mm[n]), 0.3, -0.3) for n in passes]
    return found


def ring(track, at_mm, frame):
    return Sighting(frame, float(at_mm - track.distance_mm[frame]), 0.2, -0.3)
