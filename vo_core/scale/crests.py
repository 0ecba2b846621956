"""The crests of a corrugated wall as a ruler: how many waves of known pitch lie between two."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vo_core.drift import Drift, Places, row_of
from vo_core.joints.chains import COUNTABLE
from vo_core.joints.lattice import Joint
from vo_core.joints.sightings import Sighting, crests, places_mm, seen_variance
from vo_core.rig import Corrugation
from vo_core.scale.evidence import CrestSpacing
from vo_core.track import Track

PITCH_SIGMA = 0.003
"""Relative uncertainty of a stated pitch, one sigma: 2 mm on ten waves."""

SCATTER = 0.01
"""Scatter of single waves about their pitch, one sigma, relative: metal is rolled evenly."""

MOST_PLACES = 100
"""Most places that enter the equations, whose cost grows with the cube."""

SEEN_PITCH_SIGMA = 0.01
"""Relative uncertainty of the pitch that is seen around a crest, one sigma."""


def crest_spacing(
    track: Track, sightings: Sequence[Sighting], corrugation: Corrugation | None
) -> CrestSpacing | None:
    """Count the waves between the crests that were seen; None if there are fewer than two.

    From one sighting to the next the pitch that is seen gives the number of waves, whatever the
    scale of the track is. Where the way between them is too uncertain the count begins anew.
    """
    seen = sorted(crests(sightings), key=lambda sighting: sighting.frame)
    if corrugation is None or len(seen) < 2:
        return None
    at_mm, drift = places_mm(track, seen), Drift.of(track)
    rows = np.array([row_of(track, sighting.frame) for sighting in seen])
    between = drift.between(Places(rows[:-1], at_mm[:-1]), Places(rows[1:], at_mm[1:]))
    own, wave_mm = seen_variance(seen), np.array([sighting.wave_mm for sighting in seen])
    pitch_mm = (wave_mm[:-1] + wave_mm[1:]) / 2
    waves = np.rint(np.diff(at_mm) / pitch_mm).astype(int)
    variance = between + own[:-1] + own[1:] + (SEEN_PITCH_SIGMA * waves * pitch_mm) ** 2
    goes_on = variance < (COUNTABLE * pitch_mm) ** 2
    joints = [Joint(seen[0], 0, 0)]
    for sighting, number, is_counted in zip(seen[1:], waves.tolist(), goes_on, strict=True):
        last = joints[-1]
        if is_counted:
            joints.append(Joint(sighting, last.count, last.number + number))
        else:
            joints.append(Joint(sighting, last.count + 1, 0))
    if joints[-1].count == len(joints) - 1:
        return None
    pitch = corrugation.pitch_mm
    return CrestSpacing(_thinned(joints), pitch, PITCH_SIGMA * pitch, SCATTER * pitch)


def _thinned(joints: list[Joint]) -> tuple[Joint, ...]:
    """About `MOST_PLACES` of many places, with the ends of each count."""
    step = max(1, len(joints) // MOST_PLACES)
    count = np.array([joint.count for joint in joints])
    begins = np.diff(count, prepend=-1) > 0
    kept = begins | np.append(begins[1:], True) | (np.arange(len(joints)) % step == 0)
    return tuple(joints[n] for n in np.flatnonzero(kept))


def seen_pitch_mm(sightings: Sequence[Sighting]) -> float | None:
    """From crest to crest by the track, the median over the run; None where there are no waves."""
    seen = [sighting.wave_mm for sighting in crests(sightings)]
    return float(np.median(seen)) if seen else None
