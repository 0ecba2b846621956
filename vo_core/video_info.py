"""What a video says of itself."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class VideoInfo:
    """What the container states about its video; none of it is trusted for timing."""

    width: int
    """Of the pictures as they are shown, after the turn that the container states."""
    height: int
    codec: str
    container: str
    pixel_format: str | None
    frames: int | None
    """Estimated number of frames, for progress bars only; None if nothing is stated."""
    duration_s: float | None
    """None if nothing is stated."""
    rate_hz: float | None
    pixel_aspect: float = 1.0
    """Width of a pixel by its height, as the pictures are shown; 1 if nothing is stated."""
