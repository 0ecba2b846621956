"""The first frames of a film, which are tracked again once more is known of the film."""

from __future__ import annotations

from vo_core.image.resample import kept_apart
from vo_core.types import Image

SLOW_S = 0.2
"""Frame period from which the robot may leave the near wall from one frame to the next."""


class Opening:
    """Keeps the first frames with their times, until it is full or closed."""

    def __init__(self) -> None:
        self._frames: list[tuple[Image, float]] = []
        self._is_closed = False

    def __len__(self) -> int:
        return len(self._frames)

    @property
    def frames(self) -> tuple[tuple[Image, float], ...]:
        """The frames that are kept, (H, W) grey, and their times in s."""
        return tuple(self._frames)

    def is_slow(self, t_s: float) -> bool:
        """Whether the film has few frames a second, by the time of its second frame."""
        return len(self._frames) == 1 and t_s - self._frames[0][1] > SLOW_S

    def keep(self, image: Image, t_s: float) -> None:
        """Keep the next frame as well, unless the opening is closed."""
        most_frames = 60  # bands of a lamp and a mask of fixed parts show within two seconds
        most_bytes = 64_000_000
        if self._is_closed:
            return
        self._frames.append((kept_apart(image), t_s))
        bytes_kept = len(self._frames) * image.nbytes
        if len(self._frames) >= most_frames or bytes_kept >= most_bytes:
            self.close()

    def close(self) -> None:
        """Drop the frames, and keep none from now on."""
        self._frames, self._is_closed = [], True
