"""Compares the readings of a film's counter with the track of the film."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import cast

from app.burnt_in.readings import CounterReadings
from vo_core import Track
from vo_core.errors import InvalidCorrection
from vo_core.scale.counter import CounterComparison, Unit, compare_counter


def with_track(
    readings: CounterReadings, track: Track, unit: Unit | None = None
) -> CounterComparison:
    """Compare the readings with a raw track of the same film.

    Args:
        readings: Of a film whose counter was found.
        track: Each of its frames is a frame of the film.
        unit: Of a counter that shows none.
    Raises:
        InvalidCorrection: The unit is unknown or differs from the one that the film shows, or the
            track has other frames than the film.
    """
    place = readings.place
    shown: Unit | None = (place.unit or None) if place else None
    if place is None or (shown or unit) is None:
        raise InvalidCorrection("The counter shows no unit; state whether it is m or ft.")
    if shown is not None and unit not in (None, shown):
        raise InvalidCorrection(f"The film shows {shown} beside its counter, not {unit}.")
    if len(track) and int(track.frame[-1]) >= len(readings.reading):
        raise InvalidCorrection(
            f"The track has a frame {track.frame[-1]}; the film ends with frame "
            f"{len(readings.reading) - 1}."
        )
    return compare_counter(
        track,
        readings.reading[track.frame],
        unit=cast("Unit", shown or unit),
        tick=10.0**-place.decimals,
    )


def comparison_to_json(found: CounterComparison) -> str:
    """Write what a page needs to draw the comparison; lengths in mm."""
    fields = asdict(found)
    if found.scale is None:
        fields["sigma"] = None
    return json.dumps(fields | {"agrees": found.agrees, "sentence": str(found)}, indent=2) + "\n"
